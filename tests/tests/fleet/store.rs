//! The directory in NATS.

use super::wire::Wire;
use jostle_server::fleet::directory::Answer;
use jostle_server::fleet::entry::{Entry, Key, Owner, RoomEntry, RoomFacts};
use jostle_server::fleet::nats::{Store, connect};
use jostle_server::fleet::settings::FleetSettings;
use jostle_tests::nats::Cluster;
use serde_json::json;

const ROOMS: &str = "KV_jostle_rooms";

fn settings(cluster: &Cluster) -> FleetSettings {
    FleetSettings {
        nats: cluster.url(),
        credentials: None,
        replicas: 1,
        node: "a".into(),
        url: "https://a.example.org".into(),
        capacity: 1.0,
        secret: [7; 32],
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn removals_of_rooms_expire_also_in_a_bucket_of_an_earlier_version() {
    // The stream, as created by the previous version.
    let earlier = json!({
        "name": ROOMS, "subjects": ["$KV.jostle_rooms.>"], "max_msgs_per_subject": 1, "num_replicas": 1,
        "discard": "new", "allow_rollup_hdrs": true, "deny_delete": true, "allow_direct": true,
    });
    for bucket in [None, Some(earlier)] {
        let cluster = Cluster::start(1).await.expect("a server");
        let mut wire = Wire::connect(cluster.addresses()[0]).await;
        if let Some(bucket) = &bucket {
            wire.ask(&format!("$JS.API.STREAM.CREATE.{ROOMS}"), bucket).await;
        }
        let settings = settings(&cluster);
        let context = connect(&settings).await.expect("an address");
        let store = Store::open(&context, &settings).await.expect("a store");
        let key = Key::Room("k7f3q2".into());
        let room = RoomFacts {
            scene: "arena".into(),
            number: 1,
            private: false,
            creator: None,
            guest: false,
        };
        let owner = Owner { node: "a".into(), incarnation: 1 };
        let entry = Entry::Room(RoomEntry { owner, epoch: 1, room });
        for _ in 0..2 {
            let written = store.write(&key, &entry, 0).await;
            let Answer::Done(revision) = written else { panic!("{written:?}") };
            assert_eq!(store.look(&key).await, Ok(Some((entry.clone(), revision))));
            assert_eq!(store.remove(&key, revision + 1).await, Answer::Unknown, "another revision");
            assert_eq!(store.remove(&key, revision).await, Answer::Done(0));
            assert_eq!(store.look(&key).await, Ok(None));
        }
        let last = json!({"last_by_subj": "$KV.jostle_rooms.k7f3q2"});
        let last = wire.ask(&format!("$JS.API.STREAM.MSG.GET.{ROOMS}"), &last).await;
        let headers = last["message"]["hdrs"].as_str().expect("headers");
        let headers = data_encoding::BASE64.decode(headers.as_bytes()).expect("base64");
        let headers = String::from_utf8(headers).expect("text");
        assert!(headers.contains("Nats-TTL: 86400\r\n"), "{headers}");
    }
}

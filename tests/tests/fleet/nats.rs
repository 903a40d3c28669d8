//! Checks that the NATS servers and the proxy behave as the other tests assume.

use super::wire::Wire;
use jostle_tests::nats::Cluster;
use jostle_tests::nats::proxy::Proxy;
use jostle_tests::server::LONG;
use serde_json::Value;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

/// Number of round trips made while a connection stalls; anything forwarded would arrive in the meantime.
const ROUND_TRIPS: usize = 200;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cluster_of_three_tells_clients_no_other_addresses() {
    let cluster = Cluster::start(3).await.expect("a cluster");
    let addresses = cluster.addresses();
    let urls: Vec<String> = addresses.iter().map(|address| format!("nats://{address}")).collect();
    assert_eq!(cluster.url(), urls.join(","));
    for address in addresses {
        let wire = Wire::connect(address).await;
        assert_eq!(wire.info["jetstream"], true, "{}", wire.info);
        assert_eq!(wire.info["connect_urls"], Value::Null, "{}", wire.info);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_server_alone_keeps_streams_too() {
    let mut cluster = Cluster::start(1).await.expect("a server");
    let mut wire = Wire::connect(cluster.addresses()[0]).await;
    assert_eq!(cluster.leader_of_stream("letters").await.expect("an answer"), None);
    wire.create_stream("letters", 1).await;
    assert_eq!(wire.keep("letters", "a").await, 1);
    assert_eq!(cluster.leader_of_stream("letters").await.expect("an answer"), Some(0));
    cluster.kill(0);
    assert!(TcpStream::connect(cluster.addresses()[0]).await.is_err());
    cluster.restart(0).await.expect("a server");
    cluster.ready().await.expect("a ready server");
    assert_eq!(Wire::connect(cluster.addresses()[0]).await.count_of("letters").await, 1);
}

/// Waits until one of the servers leads the stream.
async fn leader(cluster: &Cluster, stream: &str) -> usize {
    let found = async {
        loop {
            if let Some(leader) = cluster.leader_of_stream(stream).await.expect("an answer") {
                return leader;
            }
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, found).await.expect("a leader in time")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_of_three_goes_on_without_its_leader_which_returns_with_its_files() {
    let mut cluster = Cluster::start(3).await.expect("a cluster");
    let addresses = cluster.addresses();
    let mut wire = Wire::connect(addresses[0]).await;
    wire.create_stream("letters", 3).await;
    assert_eq!(wire.keep("letters", "a").await, 1);

    let killed = leader(&cluster, "letters").await;
    cluster.kill(killed);
    cluster.ready().await.expect("a cluster of the other two");
    let next = leader(&cluster, "letters").await;
    assert_ne!(next, killed);
    let mut wire = Wire::connect(addresses[next]).await;
    assert_eq!(wire.keep("letters", "b").await, 2);

    cluster.restart(killed).await.expect("a server");
    cluster.ready().await.expect("a cluster of three");
    assert_eq!(Wire::connect(addresses[killed]).await.count_of("letters").await, 2);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_connection_through_the_proxy_stalls_and_goes_on() {
    let cluster = Cluster::start(1).await.expect("a server");
    let proxy = Proxy::start(cluster.addresses()).await.expect("a proxy");
    let mut here = Wire::connect(cluster.addresses()[0]).await;
    here.subscribe("up").await;
    let mut there = Wire::connect(proxy.address()).await;
    there.subscribe("down").await;

    proxy.stall();
    there.publish("up", "of before").await;
    here.publish("down", "of before").await;
    let newcomer = TcpStream::connect(proxy.address()).await.expect("a proxy that accepts");
    for _ in 0..ROUND_TRIPS {
        here.ping().await;
    }
    assert!(here.is_silent() && there.is_silent());
    let unread = newcomer.try_read(&mut [0]);
    assert!(unread.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock));

    proxy.resume();
    assert_eq!(here.message().await, "of before");
    assert_eq!(there.message().await, "of before");
    there.ping().await;
    Wire::begin(newcomer).await.ping().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_end_of_a_server_waits_for_the_network_too() {
    let mut cluster = Cluster::start(1).await.expect("a server");
    let proxy = Proxy::start(cluster.addresses()).await.expect("a proxy");
    let there = Wire::connect(proxy.address()).await;
    proxy.stall();
    cluster.kill(0);
    cluster.restart(0).await.expect("a server");
    let mut here = Wire::connect(cluster.addresses()[0]).await;
    for _ in 0..ROUND_TRIPS {
        here.ping().await;
    }
    assert!(there.is_silent());
    proxy.resume();
    there.ends().await;
    Wire::connect(proxy.address()).await.ping().await;
}

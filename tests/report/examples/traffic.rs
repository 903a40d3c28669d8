//! Prints what a client costs in each scene of `traffic`: bytes a second, sizes of messages, bits for
//! each body that moved, and what coding takes.
//!
//! Usage: `cargo run --release -p jostle-report --example traffic`

use jostle_report::traffic::measure::JostleCrowd;
use jostle_report::traffic::{SCENES, send};

fn main() {
    println!("scene  Hz  kB/s  on the wire  p50  p99  max  bits a move  encode us  decode us");
    for scene in SCENES {
        let mut script = scene();
        let mut crowd = JostleCrowd::new(&script);
        for traffic in send(&mut script, &mut crowd, &[60, 20, 5], u32::MAX) {
            let [payload, wire] = traffic.bytes_per_s();
            let each = |us: f64| us / traffic.sizes.len().max(1) as f64;
            println!(
                "{:5} {:3} {:6.2} {:6.2} {:5} {:5} {:5} {:6.1} {:7.1} {:7.1}",
                script.name,
                traffic.rate,
                payload / 1000.0,
                wire / 1000.0,
                traffic.percentile(0.5),
                traffic.percentile(0.99),
                traffic.percentile(1.0),
                traffic.bits_per_moved(),
                each(traffic.encode_us),
                each(traffic.decode_us),
            );
        }
    }
}

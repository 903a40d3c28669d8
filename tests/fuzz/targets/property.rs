//! Tries the property from `jostle_fuzz` that is named by `JOSTLE_PROPERTY`.

#![no_main]

use jostle_fuzz::{Property, property};
use std::sync::LazyLock;

static TRIED: LazyLock<Property> = LazyLock::new(|| {
    let name = std::env::var("JOSTLE_PROPERTY").expect("JOSTLE_PROPERTY names a property");
    property(&name).expect("a property of this build")
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| TRIED(bytes));

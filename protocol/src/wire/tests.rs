use super::*;

fn leb(value: u64) -> Vec<u8> {
    let mut writer = Writer::new();
    writer.leb64(value);
    writer.finish()
}

#[test]
fn leb128_has_the_known_bytes() {
    assert_eq!(leb(0), [0]);
    assert_eq!(leb(127), [0x7f]);
    assert_eq!(leb(128), [0x80, 1]);
    assert_eq!(leb(624_485), [0xe5, 0x8e, 0x26]);
    assert_eq!(leb(u64::MAX), [255, 255, 255, 255, 255, 255, 255, 255, 255, 1]);
}

#[test]
fn leb128_round_trips_at_every_length() {
    for bit in 0..64 {
        for value in [1u64 << bit, (1u64 << bit) - 1, 1u64 << bit | 1] {
            let bytes = leb(value);
            assert_eq!(Reader::new(&bytes).leb64("x"), Ok(value));
            let narrow = u32::try_from(value).map_err(|_| DecodeError::OutOfRange { field: "x" });
            assert_eq!(Reader::new(&bytes).leb32("x"), narrow);
        }
    }
}

#[test]
fn leb128_is_refused_unless_shortest_and_in_range() {
    let refused = Err(DecodeError::OutOfRange { field: "x" });
    assert_eq!(Reader::new(&[0x80, 0]).leb64("x"), refused);
    assert_eq!(Reader::new(&[0xff, 0x80, 0]).leb64("x"), refused);
    assert_eq!(Reader::new(&[255, 255, 255, 255, 255, 255, 255, 255, 255, 2]).leb64("x"), refused);
    assert_eq!(Reader::new(&[0x80; 20]).leb64("x"), refused);
    assert_eq!(Reader::new(&[0x80]).leb64("x"), Err(DecodeError::Truncated { field: "x" }));
}

#[test]
fn zigzag_round_trips_at_both_ends() {
    for value in [0, -1, 1, -64, 63, 64, i32::MIN, i32::MAX] {
        let mut writer = Writer::new();
        writer.zigzag(value);
        let bytes = writer.finish();
        assert_eq!(bytes.len() == 1, (-64..64).contains(&value));
        assert_eq!(Reader::new(&bytes).zigzag("x"), Ok(value));
    }
}

#[test]
fn quanta_out_of_range_are_refused() {
    let read = |value: i32| {
        let mut writer = Writer::new();
        writer.quanta([0, value]);
        Reader::new(&writer.finish()).quanta("x")
    };
    for inside in [0, QUANTA_MAX, -QUANTA_MAX] {
        assert_eq!(read(inside), Ok([0, inside]));
    }
    for outside in [QUANTA_MAX + 1, -QUANTA_MAX - 1, i32::MAX, i32::MIN] {
        assert_eq!(read(outside), Err(DecodeError::OutOfRange { field: "x" }));
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let bytes = value.to_bits().to_le_bytes();
        assert_eq!(Reader::new(&bytes).finite("x"), Err(DecodeError::OutOfRange { field: "x" }));
    }
    let bytes = f32::MAX.to_bits().to_le_bytes();
    assert_eq!(Reader::new(&bytes).finite("x"), Ok(f32::MAX));
}

#[test]
fn a_count_is_checked_against_its_limit_and_the_rest() {
    let read = |count: u32, rest: usize| {
        let mut writer = Writer::new();
        writer.leb32(count);
        writer.raw(&vec![0; rest]);
        Reader::new(&writer.finish()).count(1000, 9, "x")
    };
    assert_eq!(read(3, 27), Ok(3));
    assert_eq!(read(3, 26), Err(DecodeError::Truncated { field: "x" }));
    assert_eq!(read(1000, 0), Err(DecodeError::Truncated { field: "x" }));
    assert_eq!(read(1001, 0), Err(DecodeError::OutOfRange { field: "x" }));
    assert_eq!(read(u32::MAX, 0), Err(DecodeError::OutOfRange { field: "x" }));
}

#[test]
fn text_must_be_short_enough_and_utf8() {
    let read = |bytes: &[u8]| Reader::new(bytes).text(4, "x").map(str::to_owned);
    assert_eq!(read(&[2, 0xc3, 0xbc]), Ok("ü".to_owned()));
    assert_eq!(read(&[1, 0xc3]), Err(DecodeError::OutOfRange { field: "x" }));
    assert_eq!(read(&[5, 65, 65, 65, 65, 65]), Err(DecodeError::OutOfRange { field: "x" }));
    assert_eq!(read(&[3, 65, 65]), Err(DecodeError::Truncated { field: "x" }));
}

#[test]
fn bits_round_trip_and_their_padding_is_zero() {
    for count in 0..20 {
        let mut writer = Writer::new();
        writer.bits((0..count).map(|index| index % 3 == 0));
        let bytes = writer.finish();
        let bits = Reader::new(&bytes).bits(count, "x").unwrap();
        assert!((0..count).map(|index| index % 3 == 0).eq(bits));
    }
    assert!(Reader::new(&[0b111]).bits(3, "x").is_ok());
    let refused = Reader::new(&[0b1000]).bits(3, "x").unwrap_err();
    assert_eq!(refused, DecodeError::OutOfRange { field: "x" });
}

#[test]
fn gaps_grow_and_stay_below_their_end() {
    let mut writer = Writer::new();
    let mut gaps = Gaps::default();
    [0, 1, 7, 300].into_iter().for_each(|value| gaps.write(&mut writer, value));
    let bytes = writer.finish();
    assert_eq!(bytes, [0, 0, 5, 0xa4, 2]);

    let (mut reader, mut gaps) = (Reader::new(&bytes), Gaps::default());
    assert_eq!(gaps.read(&mut reader, 2, "x"), Ok(0));
    assert_eq!(gaps.read(&mut reader, 2, "x"), Ok(1));
    assert_eq!(gaps.read(&mut reader, 7, "x"), Err(DecodeError::OutOfRange { field: "x" }));
    let mut reader = Reader::new(&[0xff, 0xff, 0xff, 0xff, 0x0f]);
    let refused = gaps.read(&mut reader, usize::MAX, "x");
    assert_eq!(refused, Err(DecodeError::OutOfRange { field: "x" }));
}

#[test]
fn left_over_bytes_are_counted() {
    assert_eq!(Reader::new(&[]).end(), Ok(()));
    assert_eq!(Reader::new(&[1, 2]).end(), Err(DecodeError::Trailing { count: 2 }));
}

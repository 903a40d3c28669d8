use super::{Ratio, median};

#[test]
fn medians_of_ratios_are_in_the_middle_of_their_decades() {
    let of = |values: &[f64]| {
        let ratios: Vec<Ratio> =
            values.iter().map(|&v| Ratio { error: v, time: 1.0 / v }).collect();
        median(&ratios)
    };
    assert_eq!(of(&[100.0, 1.0, 10.0]), Ratio { error: 10.0, time: 0.1 });
    assert_eq!(of(&[1.0, 100.0]).error, 10.0);
}

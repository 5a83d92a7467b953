//! Numbers as messages show them.

/// Returns a number as people write it: six decimals without trailing zeros, or an exponent where those say nothing.
pub fn short(v: f64) -> String {
    if v != 0.0 && !(1e-4..1e15).contains(&v.abs()) {
        let text = format!("{v:.6e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return if v.is_finite() {
            format!("{}e{exponent}", digits.trim_end_matches('0').trim_end_matches('.'))
        } else {
            v.to_string()
        };
    }
    let text = format!("{v:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Returns a number with as many digits as tell it from every other, and an exponent where it would have many zeros.
pub fn exact(v: f64) -> String {
    format!("{v:?}").trim_end_matches(".0").to_owned()
}

#[cfg(test)]
mod tests {
    use super::{exact, short};

    #[test]
    fn numbers_are_short() {
        for (v, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (5000.0, "5000"),
            (0.1 + 0.2, "0.3"),
            (123_456.75, "123456.75"),
            (1e-300, "1e-300"),
            (-1.5e30, "-1.5e30"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(short(v), text);
        }
    }

    #[test]
    fn exact_numbers_have_no_row_of_zeros() {
        for (v, text) in [(1e-300, "1e-300"), (-1.0, "-1"), (0.1, "0.1"), (1e300, "1e300"), (f64::NAN, "NaN")]
        {
            assert_eq!(exact(v), text);
        }
    }
}

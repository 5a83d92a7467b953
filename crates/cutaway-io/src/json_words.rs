//! What is wrong with JSON, in the words of the file rather than those of the program that reads it.

use crate::volume::error::shown_name;

/// What serde calls things, and what a user calls them.
const WORDS: [(&str, &str); 24] = [
    ("invalid type: ", "found "),
    ("invalid value: ", "found "),
    ("invalid length ", "found a list of "),
    ("floating point `", "the number `"),
    ("integer `", "the number `"),
    ("boolean `", "`"),
    ("string \"", "the text \""),
    ("null, ", "`null`, "),
    ("expected u8", "expected a whole number from 0 to 255"),
    ("expected u32", "expected a whole number of at least 0"),
    ("expected u64", "expected a whole number of at least 0"),
    ("expected usize", "expected a whole number of at least 0"),
    ("expected i64", "expected a whole number"),
    ("expected f32", "expected a number"),
    ("expected f64", "expected a number"),
    ("expected an array of length", "expected a list of"),
    ("expected a sequence", "expected a list"),
    ("expected a map", "expected an object"),
    ("expected a boolean", "expected `true` or `false`"),
    ("expected a string", "expected a text"),
    ("expected struct ControlPoint", "expected an object with `value`, `color` and `opacity`"),
    ("sequence, expected", "a list, expected"),
    ("map, expected", "an object, expected"),
    (
        "did not match any variant of untagged enum Flag",
        "found something else than `true`, `false` or a number",
    ),
];

/// What serde says of JSON, in plain words, on one line of bearable length: it repeats names from the file as they are.
pub(crate) fn plain(error: &serde_json::Error) -> String {
    const LONGEST: usize = 200;
    let text = shown_name(&error.to_string());
    let place = format!(" at line {} column {}", error.line(), error.column());
    let what = text.strip_suffix(&place).unwrap_or(&text);
    let mut short: String = what.chars().take(LONGEST).collect();
    let cut = short.len() < what.len();
    for (from, to) in WORDS {
        short = short.replace(from, to);
    }
    // Other types of ours: their names say nothing to who wrote the file.
    if let Some(at) = short.find("expected struct ") {
        short.truncate(at);
        short.push_str("expected an object");
    }
    if cut {
        short.push_str("...");
    }
    short + &place
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer_function::TransferFunctionFile;

    #[test]
    fn errors_use_the_words_of_json() {
        let says =
            |json: &str| plain(&serde_json::from_str::<TransferFunctionFile>(json).map(|_| ()).unwrap_err());
        let point = |value: &str| {
            format!("{{\"points\": [{{\"value\": {value}, \"color\": [0, 0, 0], \"opacity\": 0}}]}}")
        };
        assert_eq!(says(&point("\"a\"")), "found the text \"a\", expected a number at line 1 column 25");
        assert!(
            says("{\"points\": [7]}").starts_with("found the number `7`, expected an object with `value`")
        );
        assert!(says("{\"points\": {}}").contains("found an object, expected a list"));
        assert!(says(&point("1").replace("[0, 0, 0]", "[0, 0]")).contains("expected a list of 3"));
        assert!(says("{\"points\": [").contains("EOF") || says("{\"points\": [").contains("end"));
    }
}

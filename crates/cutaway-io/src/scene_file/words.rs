//! What is wrong with a JSON file, in plain words: the field, what it holds, what is expected.

use serde::de::DeserializeOwned;

/// Reads JSON. An error is one line: place, field, what was found and what was expected.
pub(super) fn parse<T: DeserializeOwned>(text: &[u8]) -> Result<T, String> {
    let mut reader = serde_json::Deserializer::from_slice(text);
    let read = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let path = error.path().to_string();
        said(&path, error.inner())
    });
    let value = read?;
    reader.end().map_err(|error| said(".", &error))?;
    Ok(value)
}

/// The longest that a message may be: it repeats words of the file.
const LONGEST: usize = 300;

fn said(path: &str, error: &serde_json::Error) -> String {
    let (line, column) = (error.line(), error.column());
    let text = error.to_string();
    let place = format!(" at line {line} column {column}");
    let what = plain(text.strip_suffix(&place).unwrap_or(&text));
    let field = if path == "." { String::new() } else { format!("`{path}`: ") };
    let place = if line > 0 { format!("line {line}, column {column}: ") } else { String::new() };
    let short: String = what.chars().take(LONGEST).collect();
    let dots = if short.len() < what.len() { "..." } else { "" };
    format!("{place}{field}{short}{dots}")
}

/// Sentences of the parser and what they mean.
fn plain(text: &str) -> String {
    for kind in ["invalid type: ", "invalid value: "] {
        if let Some((found, expected)) =
            text.strip_prefix(kind).and_then(|rest| rest.split_once(", expected "))
        {
            return format!("found {}, expected {}", found_words(found), expected_words(expected));
        }
    }
    if let Some((found, expected)) =
        text.strip_prefix("invalid length ").and_then(|rest| rest.split_once(", expected "))
    {
        return format!("found {found} entries, expected {}", expected_words(expected));
    }
    if let Some(name) = text.strip_prefix("missing field ") {
        return format!("the field {name} is missing");
    }
    if let Some(rest) = text.strip_prefix("unknown field ") {
        return unknown("field", rest);
    }
    if let Some(rest) = text.strip_prefix("unknown variant ") {
        return unknown("choice", rest);
    }
    if let Some(name) = text.strip_prefix("duplicate field ") {
        return format!("the field {name} is there twice");
    }
    match text {
        "EOF while parsing a value" if text.len() < 30 => {
            "the file ends where a value is expected".to_owned()
        }
        _ if text.starts_with("EOF while parsing") => "the file ends before it is complete".to_owned(),
        _ => text.to_owned(),
    }
}

/// `a`, expected one of `b`, `c`.
fn unknown(what: &str, rest: &str) -> String {
    let Some((name, known)) = rest.split_once(", expected ") else {
        return format!("there is no {what} {}", rest.trim_end_matches(", there are no fields"));
    };
    let known = known.strip_prefix("one of ").unwrap_or(known);
    format!("there is no {what} {name}; choose from {known}")
}

fn found_words(found: &str) -> String {
    for (kind, name) in [("integer `", ""), ("floating point `", ""), ("boolean `", "")] {
        if let Some(value) = found.strip_prefix(kind) {
            return format!("{name}{}", value.trim_end_matches('`'));
        }
    }
    match found {
        "map" => "an object".to_owned(),
        "sequence" => "a list".to_owned(),
        "null" => "null".to_owned(),
        _ => found.strip_prefix("string ").unwrap_or(found).to_owned(),
    }
}

fn expected_words(expected: &str) -> String {
    let words = match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of 0 or more",
        "i8" | "i16" | "i32" | "i64" => "a whole number",
        "f32" | "f64" => "a number",
        "a sequence" => "a list",
        "a map" => "an object",
        "a boolean" => "true or false",
        "a string" => "text",
        _ => "",
    };
    if !words.is_empty() {
        return words.to_owned();
    }
    if let Some(count) = expected.strip_prefix("an array of length ") {
        return format!("a list of {count}");
    }
    match expected.strip_prefix("struct ").map(|name| name.split(' ').next().unwrap_or(name)) {
        Some("ControlPoint") => "an object with `value`, `color` and `opacity`".to_owned(),
        Some("Camera") => "an object with `position` and `focal_point`".to_owned(),
        Some("SceneFile") => "an object with `volume`".to_owned(),
        Some(_) => "an object".to_owned(),
        None => expected.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_file::SceneFile;

    fn error(text: &str) -> String {
        parse::<SceneFile>(text.as_bytes()).unwrap_err()
    }

    #[test]
    fn report_b6_wrong_fields_are_named_in_plain_words() {
        for (text, says) in [
            (r#"{"volume": {"what": 3}}"#, "there is no field `what`; choose from `path`"),
            (r#"{"volume": 7}"#, "`volume`: found 7, expected a path"),
            (r#"{"volume": {"dims": [1, 2, 3]}}"#, "the field `path` is missing"),
            (
                r#"{"volume": "v", "render": {"resolution": [-1, 8]}}"#,
                "`render.resolution[0]`: found -1, expected a whole number of 0 or more",
            ),
            (r#"{"volume": "v", "render": {"resolution": [8]}}"#, "`render.resolution"),
            (
                r#"{"volume": "v", "render": {"mode": "mipp"}}"#,
                "there is no choice `mipp`; choose from `composite`",
            ),
            (
                r#"{"volume": "v", "transfer_function": {"points": [3]}}"#,
                "`transfer_function.points[0]`: found 3, expected an object with `value`, `color` and `opacity`",
            ),
            (
                r#"{"volume": "v", "transfer_function": {"points": [{"value": true, "color": [0, 0, 0], "opacity": 1}]}}"#,
                "`transfer_function.points[0].value`: found true, expected a number",
            ),
            (r#"{"volume": "v", "clip": {"blob": 1}}"#, "`blob`"),
            (r#"{"volume": "v", "lighting": 4}"#, "`lighting`: found 4, expected an object"),
            (r#"{"volume": "v", "render": 4}"#, "found 4, expected an object"),
            (r#"{"volume": "v""#, "the file ends before it is complete"),
            ("[]", "expected an object with `volume`"),
        ] {
            let error = error(text);
            assert!(error.contains(says), "{text}: {error}");
            for word in ["struct", "u32", "f64", "untagged", "variant", "invalid type", "EOF"] {
                assert!(!error.contains(word), "{text}: {error}");
            }
        }
    }
}

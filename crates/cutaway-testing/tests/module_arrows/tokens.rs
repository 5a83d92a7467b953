//! Rust's text as words and signs, as far as paths need it.

/// A word, `::`, or any other sign. Comments, literals and lifetimes are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Token<'a> {
    Word(&'a str),
    Colons,
    Sign(char),
}

pub(crate) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if let Some(length) = skipped(rest) {
            length
        } else if first.is_alphanumeric() || first == '_' {
            let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            found.push(Token::Word(&rest[..length]));
            length
        } else if rest.starts_with("::") {
            found.push(Token::Colons);
            2
        } else {
            found.push(Token::Sign(first));
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    found
}

/// How long what is no token at the beginning of a text is; none: a token begins here.
fn skipped(text: &str) -> Option<usize> {
    let first = text.chars().next()?;
    if first.is_whitespace() {
        return Some(first.len_utf8());
    }
    if text.starts_with("//") {
        return Some(text.find('\n').unwrap_or(text.len()));
    }
    if text.starts_with("/*") {
        return Some(block_comment(text));
    }
    let prefix = ["br", "cr", "b", "c", "r"].into_iter().find(|prefix| {
        text.strip_prefix(prefix).is_some_and(|rest| {
            let raw = prefix.ends_with('r');
            rest.starts_with('"')
                || raw && rest.trim_start_matches('#').starts_with('"') && rest.starts_with('#')
        })
    });
    let prefix = prefix.unwrap_or_default();
    let literal = &text[prefix.len()..];
    if prefix.ends_with('r') {
        let marks = literal.len() - literal.trim_start_matches('#').len();
        let end = format!("\"{}", "#".repeat(marks));
        let begin = prefix.len() + marks + 1;
        return Some(text[begin..].find(&end).map_or(text.len(), |at| begin + at + end.len()));
    }
    if literal.starts_with('"') {
        return Some(prefix.len() + quoted(literal, '"'));
    }
    let quote = text.strip_prefix('b').filter(|rest| rest.starts_with('\'')).unwrap_or(text);
    quote.starts_with('\'').then(|| text.len() - quote.len() + character(quote))
}

/// Block comments may lie within others.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let rest = &text[at..];
        if rest.starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest.starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    text.len()
}

/// The length of a literal with its quotes.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if !escaped && c == quote {
            return at + c.len_utf8();
        }
        escaped = c == '\\' && !escaped;
    }
    text.len()
}

/// A character in quotes, or a lifetime.
fn character(text: &str) -> usize {
    let mut chars = text.char_indices().skip(1);
    let (Some((_, first)), second) = (chars.next(), chars.next()) else { return text.len() };
    let closed = second.is_some_and(|(_, c)| c == '\'');
    if first == '\\' || closed {
        return quoted(text, '\'');
    }
    let name = text[1..].find(|c: char| !(c.is_alphanumeric() || c == '_'));
    name.map_or(text.len(), |end| end + 1).max(2)
}

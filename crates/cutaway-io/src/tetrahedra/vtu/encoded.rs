//! Bytes as they are or in base64, from the front.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Letters that are decoded at once.
const RUN: usize = 4096;

/// Bytes that are taken from the front. Base64 may be encoded in several parts one after the other, each with its own
/// padding, as VTK writes the lengths of compressed blocks and other programs any length; blanks in it are skipped.
pub(super) struct Encoded<'a> {
    source: &'a [u8],
    base64: bool,
    /// Decoded already.
    ready: Vec<u8>,
    taken: usize,
}

impl<'a> Encoded<'a> {
    pub(super) fn new(source: &'a [u8], base64: bool) -> Self {
        Self { source, base64, ready: Vec::new(), taken: 0 }
    }

    /// The most bytes that can still be taken.
    pub(super) fn left(&self) -> u64 {
        let ready = (self.ready.len() - self.taken) as u64;
        let source = self.source.len() as u64;
        ready + if self.base64 { source.div_ceil(4) * 3 } else { source }
    }

    /// The next bytes; none where there are not that many.
    pub(super) fn take(&mut self, count: u64) -> Option<Vec<u8>> {
        let count = usize::try_from(count).ok().filter(|_| count <= self.left())?;
        if !self.base64 {
            let (bytes, rest) = self.source.split_at_checked(count)?;
            self.source = rest;
            return Some(bytes.to_vec());
        }
        let mut bytes = Vec::with_capacity(count);
        loop {
            let missing = (count - bytes.len()).min(self.ready.len() - self.taken);
            bytes.extend_from_slice(&self.ready[self.taken..self.taken + missing]);
            self.taken += missing;
            if bytes.len() == count {
                return Some(bytes);
            }
            self.decode()?;
        }
    }

    /// Decodes the next letters; none where there are none, or where they are not base64.
    fn decode(&mut self) -> Option<()> {
        self.ready.clear();
        self.taken = 0;
        let letter = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'+' | b'/');
        let run = self.source.iter().take(RUN).take_while(|b| letter(b)).count() / 4 * 4;
        if run > 0 {
            let (letters, rest) = self.source.split_at(run);
            STANDARD.decode_vec(letters, &mut self.ready).ok()?;
            self.source = rest;
            return Some(());
        }
        // Four letters with padding or blanks among them.
        let mut four = [0; 4];
        let mut found = 0;
        while found < 4 {
            let (first, rest) = self.source.split_first()?;
            self.source = rest;
            if !first.is_ascii_whitespace() {
                four[found] = *first;
                found += 1;
            }
        }
        STANDARD.decode_vec(four, &mut self.ready).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_with_their_own_padding_are_one_run_of_bytes() {
        let bytes: Vec<u8> = (0..200).collect();
        for cut in 0..20 {
            let text = format!("{}\n {}", STANDARD.encode(&bytes[..cut]), STANDARD.encode(&bytes[cut..]));
            for first in [0, 1, 2, 3, 50, 200] {
                let mut encoded = Encoded::new(text.as_bytes(), true);
                let mut found = encoded.take(first).unwrap();
                found.extend(encoded.take(200 - first).unwrap());
                assert_eq!(found, bytes, "{cut} {first}");
                assert_eq!(encoded.take(1), None);
            }
        }
    }

    #[test]
    fn what_is_not_there_is_not_taken() {
        assert_eq!(Encoded::new(b"abc", false).take(4), None);
        assert_eq!(Encoded::new(b"abc", false).take(u64::MAX), None);
        assert_eq!(Encoded::new(b"A!==", true).take(1), None);
        assert_eq!(Encoded::new(b"AAA", true).take(1), None);
    }
}

//! Which file of a crate imports which, by the paths in its text: those of `use`, and those in the midst of code.
//!
//! A path counts as an import of the file that *defines* what it names, whatever modules hand the name on. Declaring a child
//! and handing its names on is no import; using them is one. What is compiled for tests alone does not count.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::tokens::{Token, tokens};

/// One file uses what another one defines.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Import {
    pub(crate) from: String,
    pub(crate) to: String,
}

impl fmt::Display for Import {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} -> {}", self.from, self.to)
    }
}

/// Names from the crate's root on.
type Path = Vec<String>;

/// A name that a module brings into scope.
struct Used {
    name: String,
    path: Path,
    /// For others, too.
    handed_on: bool,
}

/// A module, in a file of its own or within one.
#[derive(Default)]
struct Module {
    file: String,
    used: Vec<Used>,
    /// Modules of which all names are brought into scope.
    globs: Vec<Path>,
    /// Items of its own.
    defined: BTreeSet<String>,
    /// Paths in the midst of code, and lone words, which may be names that were brought into scope.
    mentioned: Vec<Path>,
}

type Modules = BTreeMap<Path, Module>;

/// The imports between the files of a crate, given by their paths below `src` and their texts.
pub(crate) fn imports(files: &[(String, String)]) -> BTreeSet<Import> {
    let mut modules = Modules::new();
    let mut for_tests = BTreeSet::new();
    for (file, text) in files {
        let tokens = tokens(text);
        let module = module_of(file);
        let kept = without_tests(&tokens, &module, &mut for_tests);
        Reader { modules: &mut modules, file }.read(&kept, module);
    }
    modules.retain(|path, _| !for_tests.iter().any(|test| path.starts_with(test)));
    let mut found = BTreeSet::new();
    for (path, module) in &modules {
        for target in targets(&modules, path, module) {
            let to = modules[&target].file.clone();
            if to != module.file {
                found.insert(Import { from: module.file.clone(), to });
            }
        }
    }
    found
}

fn module_of(file: &str) -> Path {
    let parts = file.trim_end_matches(".rs").split('/').filter(|part| !["mod", "lib", "main"].contains(part));
    parts.map(str::to_owned).collect()
}

/// The modules whose items a module uses.
fn targets(modules: &Modules, path: &Path, module: &Module) -> Vec<Path> {
    let mut found = Vec::new();
    for used in &module.used {
        let mentioned = || module.mentioned.iter().any(|words| words[0] == used.name);
        // A module's name alone says nothing of what is used of it.
        if !modules.contains_key(&used.path) && (!used.handed_on || mentioned()) {
            found.extend(definer(modules, &used.path, 0));
        }
    }
    for words in module.mentioned.iter().filter(|words| words.len() > 1) {
        found.extend(absolute(modules, path, module, words).and_then(|full| definer(modules, &full, 0)));
    }
    found.extend(
        module.globs.iter().filter(|glob| modules.contains_key(*glob) && !path.starts_with(glob)).cloned(),
    );
    found
}

/// From the crate's root on, a path that a module mentions; none: it leads out of the crate, or to the module itself.
fn absolute(modules: &Modules, path: &Path, module: &Module, words: &[String]) -> Option<Path> {
    if let Some(rooted) = rooted(path, words) {
        return Some(rooted);
    }
    if let Some(used) = module.used.iter().find(|used| used.name == words[0]) {
        return Some([&used.path[..], &words[1..]].concat());
    }
    let child = [&path[..], &words[..1]].concat();
    modules.contains_key(&child).then(|| [&path[..], words].concat())
}

/// From the crate's root on, a path that begins with `crate`, `self` or `super`.
fn rooted(module: &[String], words: &[String]) -> Option<Path> {
    match words[0].as_str() {
        "crate" => Some(words[1..].to_vec()),
        "self" => Some([module, &words[1..]].concat()),
        "super" => {
            let ups = words.iter().take_while(|word| *word == "super").count();
            Some([&module[..module.len().checked_sub(ups)?], &words[ups..]].concat())
        }
        _ => None,
    }
}

/// The module that defines what a path names; none: that is a module, or of another crate.
fn definer(modules: &Modules, path: &[String], depth: usize) -> Option<Path> {
    // Names that are handed on in a circle do not compile.
    if depth > 16 {
        return None;
    }
    let within = (0..=path.len()).rev().find(|n| modules.contains_key(&path[..*n]))?;
    let (place, rest) = path.split_at(within);
    let name = rest.first()?;
    let module = &modules[place];
    if module.defined.contains(name) {
        return Some(place.to_vec());
    }
    if let Some(used) = module.used.iter().find(|used| used.name == *name) {
        return definer(modules, &[&used.path[..], &rest[1..]].concat(), depth + 1);
    }
    let by_globs =
        module.globs.iter().filter_map(|glob| definer(modules, &[&glob[..], rest].concat(), depth + 1));
    // Made by a macro, if by nothing that is seen here.
    by_globs.into_iter().next().or_else(|| modules.contains_key(place).then(|| place.to_vec()))
}

/// Without what is compiled for tests alone, and what is only a visibility; notes modules in files that are for tests.
fn without_tests<'a>(all: &[Token<'a>], module: &Path, for_tests: &mut BTreeSet<Path>) -> Vec<Token<'a>> {
    let is = |at: usize, word: &str| all.get(at) == Some(&Token::Word(word));
    let sign = |at: usize, sign: char| all.get(at) == Some(&Token::Sign(sign));
    let mut kept = Vec::new();
    let mut at = 0;
    while at < all.len() {
        if sign(at, '#') && sign(at + 1, '[') && is(at + 2, "cfg") {
            let end = closing(all, at + 1) + 1;
            let attribute = &all[at + 3..end];
            let negated = attribute.contains(&Token::Word("not")) || attribute.contains(&Token::Word("any"));
            if attribute.contains(&Token::Word("test")) && !negated {
                let item = item_end(all, end);
                let words: Vec<_> = all[end..item].to_vec();
                if let Some(i) = words.iter().position(|t| *t == Token::Word("mod"))
                    && let Some(Token::Word(name)) = words.get(i + 1)
                    && words.get(i + 2) == Some(&Token::Sign(';'))
                {
                    for_tests.insert([&module[..], &[(*name).to_owned()]].concat());
                }
                at = item;
                continue;
            }
            at = end;
        } else if is(at, "pub") && sign(at + 1, '(') && (is(at + 2, "in") || sign(at + 3, ')')) {
            kept.push(all[at]);
            at = closing(all, at + 1) + 1;
        } else {
            kept.push(all[at]);
            at += 1;
        }
    }
    kept
}

/// The place of the bracket that closes the one here.
fn closing(all: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (at, token) in all.iter().enumerate().skip(open) {
        match token {
            Token::Sign('(' | '[' | '{') => depth += 1,
            Token::Sign(')' | ']' | '}') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at;
        }
    }
    all.len().saturating_sub(1)
}

/// The end of the item that begins here: of a list's entry, a comma; else a semicolon or a block.
fn item_end(all: &[Token], begin: usize) -> usize {
    let mut at = begin;
    // A `use` has braces in its midst.
    let block_ends = !all[begin..].iter().take(6).any(|t| *t == Token::Word("use"));
    while at < all.len() {
        match all[at] {
            Token::Sign(';' | ',') => return at + 1,
            Token::Sign('{') if block_ends => return closing(all, at) + 1,
            Token::Sign('(' | '[' | '{') => at = closing(all, at) + 1,
            Token::Sign(')' | ']' | '}') => return at,
            _ => at += 1,
        }
    }
    at
}

/// Notes what the modules of a file define, use and mention.
struct Reader<'a> {
    modules: &'a mut Modules,
    file: &'a str,
}

impl Reader<'_> {
    fn read(&mut self, all: &[Token], path: Path) {
        let mut module = Module { file: self.file.to_owned(), ..Module::default() };
        let mut at = 0;
        while at < all.len() {
            let Token::Word(word) = all[at] else {
                at += 1;
                continue;
            };
            let next = match all.get(at + 1) {
                Some(Token::Word(next)) => Some(*next),
                // `macro_rules! name`
                Some(Token::Sign('!')) if word == "macro_rules" => match all.get(at + 2) {
                    Some(Token::Word(next)) => Some(*next),
                    _ => None,
                },
                _ => None,
            };
            match (word, next) {
                ("use", _) => {
                    let handed_on = at > 0 && all[at - 1] == Token::Word("pub");
                    at = read_use(&all[at + 1..], &path, handed_on, &mut module) + at + 1;
                }
                ("mod", Some(name)) => {
                    let inner = [&path[..], &[name.to_owned()]].concat();
                    at += 2;
                    if all.get(at) == Some(&Token::Sign('{')) {
                        let end = closing(all, at);
                        self.read(&all[at + 1..end], inner);
                        at = end;
                    }
                }
                (
                    "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union"
                    | "macro_rules",
                    Some(name),
                ) => {
                    module.defined.insert(name.to_owned());
                    at += if word == "macro_rules" { 3 } else { 2 };
                }
                _ => at = mention(all, at, &mut module),
            }
        }
        self.modules.insert(path, module);
    }
}

/// Notes the path that begins at a word; returns its end.
fn mention(all: &[Token], begin: usize, module: &mut Module) -> usize {
    let mut words = Vec::new();
    let mut at = begin;
    while let Some(Token::Word(word)) = all.get(at) {
        words.push((*word).to_owned());
        at += 1;
        if all.get(at) != Some(&Token::Colons) {
            break;
        }
        at += 1;
    }
    let continued = begin > 0 && all[begin - 1] == Token::Colons;
    if !continued {
        module.mentioned.push(words);
    }
    at.max(begin + 1)
}

/// Notes what a `use` brings into scope; returns where it ends.
fn read_use(all: &[Token], module_path: &Path, handed_on: bool, module: &mut Module) -> usize {
    let end = all.iter().position(|t| *t == Token::Sign(';')).unwrap_or(all.len());
    tree(&all[..end], &[], &mut |words, name| {
        // Relative to the module, where it is no name of another crate; which of both is seen when it is looked up.
        let path = rooted(module_path, words).unwrap_or_else(|| [&module_path[..], words].concat());
        match name {
            Some("*") => module.globs.push(path),
            Some(name) if path != [&module_path[..], &[name.to_owned()]].concat() => {
                module.used.push(Used { name: name.to_owned(), path, handed_on });
            }
            _ => {}
        }
    });
    end
}

/// Calls `found` with the path and the name of every leaf of a tree of `use`.
fn tree(all: &[Token], prefix: &[String], found: &mut dyn FnMut(&[String], Option<&str>)) {
    let mut words = prefix.to_vec();
    let mut at = 0;
    while at < all.len() {
        match all[at] {
            Token::Word("as") => {
                let name = match all.get(at + 1) {
                    Some(Token::Word(name)) => Some(*name),
                    _ => None,
                };
                found(&words, name);
                return;
            }
            // `{self}`: the module itself, by its name.
            Token::Word("self") if words.len() == prefix.len() && !prefix.is_empty() => {}
            Token::Word(word) => words.push(word.to_owned()),
            Token::Sign('*') => {
                found(&words, Some("*"));
                return;
            }
            Token::Sign('{') => {
                let end = closing(all, at);
                for part in parts(&all[at + 1..end]) {
                    tree(part, &words, found);
                }
                return;
            }
            _ => {}
        }
        at += 1;
    }
    if !words.is_empty() {
        let name = words[words.len() - 1].clone();
        found(&words, Some(&name));
    }
}

/// What commas separate, outside of inner braces.
fn parts<'t, 'a>(all: &'t [Token<'a>]) -> Vec<&'t [Token<'a>]> {
    let (mut found, mut begin, mut at) = (Vec::new(), 0, 0);
    while at < all.len() {
        match all[at] {
            Token::Sign('{') => at = closing(all, at),
            Token::Sign(',') => {
                found.push(&all[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
        at += 1;
    }
    found.push(&all[begin..]);
    found.retain(|part| !part.is_empty());
    found
}

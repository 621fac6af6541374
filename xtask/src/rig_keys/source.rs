//! Structs and enums with their doc comments and serde attributes, from source as rustfmt leaves it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// A struct or an enum that is read from a file.
#[derive(Clone, Debug)]
pub struct Item {
    pub name: String,
    /// The file that defines it, and whose `use` lines say what its types are.
    pub file: PathBuf,
    pub docs: String,
    /// The text within `#[serde(…)]`.
    pub serde: String,
    pub shape: Shape,
}

#[derive(Clone, Debug)]
pub enum Shape {
    Struct(Vec<Field>),
    Tuple,
    Enum(Vec<Variant>),
}

#[derive(Clone, Debug)]
pub struct Field {
    pub name: String,
    pub docs: String,
    pub serde: String,
    pub type_text: String,
}

#[derive(Clone, Debug)]
pub struct Variant {
    /// As Rust has it.
    pub name: String,
    pub docs: String,
    pub is_default: bool,
    /// Fields of its own.
    pub fields: Vec<Field>,
    /// The one type in its parentheses.
    pub holds: Option<String>,
}

impl Item {
    /// The fields, or those of the variants.
    #[cfg(test)]
    pub fn fields(&self) -> Vec<&Field> {
        match &self.shape {
            Shape::Struct(fields) => fields.iter().collect(),
            Shape::Tuple => Vec::new(),
            Shape::Enum(variants) => variants.iter().flat_map(|variant| &variant.fields).collect(),
        }
    }

    /// A text among its serde attributes: `rename = "by kind"`.
    pub fn attribute(&self, key: &str) -> Option<String> {
        attribute(&self.serde, key)
    }

    /// A variant's word in files.
    pub fn word(&self, variant: &Variant) -> String {
        let style = self.attribute("rename_all").unwrap_or_default();
        let dash = if style == "kebab-case" { "-" } else { "" };
        let mut word = String::new();
        for c in variant.name.chars() {
            if c.is_uppercase() && !word.is_empty() {
                word += dash;
            }
            word.extend(c.to_lowercase());
        }
        word
    }
}

/// The text of `key = "…"` in an attribute.
pub fn attribute(serde: &str, key: &str) -> Option<String> {
    let start = serde.find(&format!("{key} = \""))? + key.len() + 4;
    let mut text = String::new();
    let mut characters = serde[start..].chars();
    while let Some(c) = characters.next() {
        match c {
            '"' => return Some(text),
            '\\' => text.extend(characters.next()),
            c => text.push(c),
        }
    }
    None
}

/// The types of palpate-rig, and those of the crates that it uses.
pub struct Types {
    items: Vec<Item>,
    /// The text of every file that has been read.
    texts: BTreeMap<PathBuf, String>,
}

/// The crates with enums that are words in files.
const CRATES: [&str; 5] =
    ["palpate-rig", "palpate-core", "palpate-mechanics", "palpate-estimators", "palpate-design"];

impl Types {
    pub fn read(root: &Path) -> Result<Self> {
        let mut files = Vec::new();
        for name in CRATES {
            collect(&root.join("crates").join(name).join("src"), &mut files)?;
        }
        let mut types = Self { items: Vec::new(), texts: BTreeMap::new() };
        for file in files {
            let text =
                fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
            types.items.extend(items(&file, &text));
            types.texts.insert(file, text);
        }
        Ok(types)
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &Item> {
        self.items.iter()
    }

    /// The types of palpate-rig that keys are read into.
    #[cfg(test)]
    pub fn of_rig(&self) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(|item| item.file.components().any(|part| part.as_os_str() == "palpate-rig"))
    }

    /// The type `name` as `file` means it: its own, or that of a crate or module that it uses.
    pub fn find(&self, file: &Path, name: &str) -> Option<&Item> {
        let named = || self.items.iter().filter(|item| item.name == name);
        let own = named().find(|item| item.file == file);
        let imported = || {
            let text = self.texts.get(file)?;
            // `use palpate_mechanics::…` or, within the crate, `use crate::…`.
            let folder = imported_from(text, name)?.replace('_', "-");
            let folder = if folder == "crate" { "palpate-rig".to_owned() } else { folder };
            let module = import_path(text, name)?;
            let mut within =
                named().filter(|item| item.file.components().any(|part| part.as_os_str() == folder.as_str()));
            let path = |item: &&Item| item.file.to_string_lossy().contains(&format!("/{module}"));
            let first = within.clone().find(path);
            first.or_else(|| within.next())
        };
        // What a crate hands on of another one has its own name.
        own.or_else(imported).or_else(|| named().next().filter(|_| named().count() == 1))
    }

    /// The number that a constant of a file is, such as `MOST`.
    pub fn constant(&self, file: &Path, name: &str) -> Option<String> {
        let text = self.texts.get(file)?;
        let line = text.lines().find(|line| line.contains(&format!("const {name}:")))?;
        Some(line.split_once('=')?.1.trim().trim_end_matches(';').replace('_', ""))
    }

    /// The words of a bound, from the table of them.
    pub fn bound(&self, name: &str) -> Option<String> {
        let declared = |text: &&String| text.contains(&format!("impl Bound for {name}"));
        let text = self.texts.values().find(declared)?;
        let rest = &text[text.find(&format!("impl Bound for {name}"))?..];
        let (value, _) = rest.split_once("WORDS: &'static str = ")?.1.split_once(';')?;
        let constant = value.rsplit("::").next()?;
        let declaration = format!("const {constant}: &'static str =");
        let words = match value.strip_prefix('"') {
            Some(words) => words,
            None => self.texts.values().find_map(|text| text.split_once(&declaration))?.1.split_once('"')?.1,
        };
        words.split_once('"').or(Some((words, ""))).map(|(words, _)| words.to_owned())
    }
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// The statements `use …;` of a file, each in one line.
fn uses(text: &str) -> Vec<String> {
    let starts = text.match_indices("\nuse ").map(|(at, _)| at + 5);
    let statement = |at: usize| Some(text[at..].split_once(';')?.0.split_whitespace().collect::<String>());
    starts.filter_map(statement).collect()
}

fn use_of(text: &str, name: &str) -> Option<String> {
    let ends = |statement: &String| {
        let words = statement.split(|c: char| !c.is_alphanumeric() && c != '_');
        words.into_iter().any(|word| word == name)
    };
    uses(text).into_iter().find(ends)
}

/// The crate that `name` is imported from.
fn imported_from(text: &str, name: &str) -> Option<String> {
    use_of(text, name)?.split("::").next().map(str::to_owned)
}

/// The module within the crate that `name` is imported from.
fn import_path(text: &str, name: &str) -> Option<String> {
    use_of(text, name)?.split("::").nth(1).map(|module| module.trim_matches(['{', '}']).to_owned())
}

/// The structs and enums of a file that derive `Deserialize`.
fn items(file: &Path, text: &str) -> Vec<Item> {
    let mut found = Vec::new();
    let mut lines = text.lines().peekable();
    let mut header = Header::default();
    while let Some(line) = lines.next() {
        if header.take(line, &mut lines) {
            continue;
        }
        let declared = std::mem::take(&mut header);
        let line = line.trim_start_matches("pub(crate) ").trim_start_matches("pub ");
        let Some((kind, rest)) = line.split_once(' ') else { continue };
        if !declared.attributes.contains("Deserialize") || !matches!(kind, "struct" | "enum") {
            continue;
        }
        let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default();
        let shape = match kind {
            _ if !line.ends_with('{') => Shape::Tuple,
            "struct" => Shape::Struct(fields(&mut lines, "}")),
            _ => Shape::Enum(variants(&mut lines)),
        };
        let (docs, serde) = (declared.docs.join(" "), declared.attributes);
        found.push(Item { name: name.to_owned(), file: file.to_owned(), docs, serde, shape });
    }
    found
}

/// Doc comments and attributes above an item.
#[derive(Default)]
struct Header {
    docs: Vec<String>,
    attributes: String,
}

impl Header {
    /// Takes a line that belongs to the header, with those that it goes on in.
    fn take<'a>(&mut self, line: &str, rest: &mut impl Iterator<Item = &'a str>) -> bool {
        let line = line.trim();
        if let Some(doc) = line.strip_prefix("///") {
            self.docs.push(doc.trim().to_owned());
            return true;
        }
        if !line.starts_with("#[") {
            return line.starts_with("//");
        }
        self.attributes += line;
        if !line.ends_with(']') {
            for line in rest.by_ref() {
                self.attributes += line.trim();
                self.attributes.push(' ');
                if line.trim_end().ends_with(")]") {
                    break;
                }
            }
        }
        true
    }
}

/// The fields up to a line that is `end`.
fn fields<'a>(lines: &mut impl Iterator<Item = &'a str>, end: &str) -> Vec<Field> {
    let mut found = Vec::new();
    let mut header = Header::default();
    while let Some(line) = lines.next() {
        if line.trim_start() == end {
            break;
        }
        if header.take(line, lines) {
            continue;
        }
        let Header { docs, attributes } = std::mem::take(&mut header);
        let declared = line.trim().trim_start_matches("pub(crate) ").trim_start_matches("pub ");
        if let Some((name, type_text)) = declared.trim_end_matches(',').split_once(": ") {
            let (name, docs) = (name.to_owned(), docs.join(" "));
            found.push(Field { name, docs, serde: attributes, type_text: type_text.to_owned() });
        }
    }
    found
}

fn variants<'a>(lines: &mut impl Iterator<Item = &'a str>) -> Vec<Variant> {
    let mut found = Vec::new();
    let mut header = Header::default();
    while let Some(line) = lines.next() {
        if line == "}" {
            break;
        }
        if header.take(line, lines) {
            continue;
        }
        let Header { docs, attributes } = std::mem::take(&mut header);
        let line = line.trim();
        let name: String = line.chars().take_while(|c| c.is_alphanumeric()).collect();
        if name.is_empty() {
            continue;
        }
        let rest = line[name.len()..].trim();
        let fields = match rest {
            "{" => fields(lines, "},"),
            _ => {
                let inline = rest.strip_prefix("{ ").and_then(|rest| rest.strip_suffix(" },"));
                let inline: Vec<String> = inline.map(|inline| format!("{inline},")).into_iter().collect();
                fields(&mut inline.iter().map(String::as_str), "},")
            }
        };
        let holds = rest.strip_prefix('(').and_then(|rest| rest.strip_suffix("),")).map(str::to_owned);
        let is_default = attributes.contains("#[default]");
        found.push(Variant { name, docs: docs.join(" "), is_default, fields, holds });
    }
    found
}

//! The page of keys, in Markdown.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::source::{Field, Item, Shape, Types};

const HEAD: &str = "# Keys of rigs and studies

A rig is a TOML file that describes a bench; a study is a set of experiments over rigs ([study files](study-files.md)). This page lists every key with its
values. Quantities are texts with units: `\"400 mm\"`, `\"3 N\"`, `\"200 GPa\"`, `\"5 um\"`. Shares are
numbers or percentages, `0.05` or `\"5 %\"`. An unknown key is an error with its place in the file.

`cargo xtask rig-keys` writes this page from the types that read the files; a test compares the two.
";

pub fn page(root: &Path) -> Result<String> {
    let types = Types::read(root)?;
    let folder = root.join("crates/palpate-rig/src");
    let find = |file: &str, name: &str| {
        types.find(&folder.join(file), name).with_context(|| format!("{file} has no {name}"))
    };
    let mut page = Page { types: &types, text: HEAD.to_owned(), explained: BTreeMap::new() };
    page.sections("The rig", find("sections.rs", "RigFile")?);
    page.sections("The study", find("study.rs", "StudyFile")?);
    Ok(linked(page.text.trim_end()) + "\n")
}

/// Turns paths of other manuals into links.
fn linked(text: &str) -> String {
    let mut pieces = text.split("docs/");
    let mut linked = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let in_path = |character: char| character.is_ascii_lowercase() || "-/".contains(character);
        match piece.split_once(".md").filter(|(path, _)| path.chars().all(in_path)) {
            Some((path, rest)) => {
                let name = path.rsplit('/').next().unwrap_or(path).replace('-', " ");
                let _ = write!(linked, "[{name}](../{path}.md){rest}");
            }
            None => linked.extend(["docs/", piece]),
        }
    }
    linked
}

struct Page<'a> {
    types: &'a Types,
    text: String,
    explained: BTreeMap<(PathBuf, String), String>,
}

impl<'a> Page<'a> {
    fn sections(&mut self, title: &str, file: &'a Item) {
        let _ = write!(self.text, "\n## {title}\n\n{}\n", file.docs);
        let Shape::Struct(fields) = &file.shape else { return };
        self.table(fields, &file.file);
        for field in fields {
            let name = key(field);
            let path = if field.type_text.starts_with("Vec<") {
                format!("`[[{name}]]`")
            } else {
                format!("`[{name}]`")
            };
            self.explain(&file.file, &field.type_text, &path, 3);
        }
    }

    /// Explains a type that is too large for a cell.
    fn explain(&mut self, file: &Path, type_text: &str, path: &str, level: usize) {
        let Some(item) = self.item(file, type_text) else { return };
        if !self.is_table(item) && !self.has_words(item) {
            return;
        }
        let place = (item.file.clone(), item.name.clone());
        if let Some(heading) = self.explained.get(&place) {
            if self.is_table(item) {
                let _ = write!(self.text, "\n{} {path}\n\nAs {heading} of the rig.\n", "#".repeat(level));
            }
            return;
        }
        self.explained.insert(place, path.to_owned());
        match &item.shape {
            Shape::Struct(fields) => {
                let _ = write!(self.text, "\n{} {path}\n\n{}\n", "#".repeat(level), item.docs);
                self.table(fields, &item.file);
                self.explain_fields(fields, &item.file, path, level);
            }
            Shape::Tuple => {}
            Shape::Enum(variants) if is_by(item, "shape") => {
                for held in variants.iter().filter_map(|variant| variant.holds.as_ref()) {
                    self.explain(&item.file, held, path, level);
                }
            }
            Shape::Enum(_) if is_by(item, "kind") => self.kinds(item, path, level),
            Shape::Enum(variants) => {
                let _ = write!(self.text, "\nWords of {path}:\n\n");
                for variant in variants {
                    let _ = writeln!(self.text, "- `{}`: {}", item.word(variant), lower(&variant.docs));
                }
            }
        }
    }

    /// Tables that the key `kind` distinguishes.
    fn kinds(&mut self, item: &'a Item, path: &str, level: usize) {
        let Shape::Enum(variants) = &item.shape else { return };
        let _ = write!(self.text, "\n{} {path}\n\n{}", "#".repeat(level), item.docs);
        let words: Vec<String> = variants.iter().map(|variant| format!("`{}`", item.word(variant))).collect();
        let without =
            item.serde.text("rename").and_then(|by| by.split_once(" or ").map(|(_, word)| word.to_owned()));
        let without = without.map_or(String::new(), |word| format!("; the default is `{word}`"));
        let _ = writeln!(self.text, " Its `kind` is one of {}{without}.", words.join(", "));
        for variant in variants {
            let kind = format!("{path}, `kind = \"{}\"`", item.word(variant));
            let held = variant.holds.as_ref().and_then(|held| self.types.find(&item.file, held));
            let (fields, file): (&[Field], &Path) = match held.map(|held| (&held.shape, &held.file)) {
                Some((Shape::Struct(fields), file)) => (fields, file),
                _ => (&variant.fields, &item.file),
            };
            let docs = held.map_or(&variant.docs, |held| &held.docs);
            let _ = write!(self.text, "\n{} {kind}\n\n{docs}\n", "#".repeat(level + 1));
            if fields.is_empty() {
                self.text += "It has no further keys.\n";
            } else {
                self.table(fields, file);
                self.explain_fields(fields, file, &kind, level + 1);
            }
        }
    }

    fn explain_fields(&mut self, fields: &[Field], file: &Path, path: &str, level: usize) {
        for field in fields {
            self.explain(file, &field.type_text, &format!("`{}` of {path}", key(field)), level + 1);
        }
    }

    fn table(&mut self, fields: &[Field], file: &Path) {
        self.text += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
        for field in fields {
            let (meaning, default) = split_default(&field.docs);
            let default = default.unwrap_or_else(|| self.default(field, file));
            let value = self.value(file, &field.type_text);
            let cells =
                [format!("`{}`", key(field)), value, default, meaning].map(|cell| cell.replace('|', "\\|"));
            let _ = writeln!(self.text, "| {} |", cells.join(" | "));
        }
    }

    /// Default of a key without one in the comment.
    fn default(&self, field: &Field, file: &Path) -> String {
        let fields_of = |item: &&Item| matches!(&item.shape, Shape::Struct(fields) if fields.iter().any(|own| std::ptr::eq(own, field)));
        let all_default = self.types.all().find(fields_of).is_some_and(|item| item.serde.has("default"));
        let is_optional = field.type_text.starts_with("Option<");
        match field.serde.text("default") {
            Some(function) if function == "yes" => "`true`".to_owned(),
            _ if is_optional => "–".to_owned(),
            _ if !field.serde.has("default") && !all_default => "required".to_owned(),
            _ if field.type_text == "bool" => "`false`".to_owned(),
            _ => match self.item(file, &field.type_text).map(|item| (item, &item.shape)) {
                Some((item, Shape::Enum(variants))) => {
                    let default = variants.iter().find(|variant| variant.is_default);
                    default.map_or("–".to_owned(), |variant| format!("`{}`", item.word(variant)))
                }
                _ => "–".to_owned(),
            },
        }
    }

    fn value(&self, file: &Path, type_text: &str) -> String {
        let text = type_text.trim();
        let (name, inner) = match text.split_once('<') {
            Some((name, rest)) => (name, rest.strip_suffix('>').unwrap_or(rest)),
            None => (text, ""),
        };
        match name {
            "Option" | "At" => self.value(file, inner),
            "Vec" => format!("list: {}", self.value(file, inner)),
            "OneOrMany" => "table, or several".to_owned(),
            "Positive" => format!("{} greater than 0", quantity(inner)),
            "NotNegative" => format!("{} of at least 0", quantity(inner)),
            "Quantity" => quantity(inner).to_owned(),
            "Fraction" => "share, at least 0 and below 1".to_owned(),
            "FalseAlarms" => {
                let bound = self.types.bound("AlarmRange").unwrap_or_default();
                format!("share, {bound}")
            }
            "Count" => {
                let (least, most) = inner.split_once(", ").unwrap_or((inner, ""));
                let most = most.trim_matches(['{', '}', ' ']);
                match self.types.constant(file, most).as_deref().unwrap_or(most) {
                    "i64::MAX" => format!("whole number of at least {least}"),
                    "u32::MAX as i64" => format!("whole number, {least} to {}", u32::MAX),
                    most => format!("whole number, {least} to {}", most.replace('_', "")),
                }
            }
            "Grid" => "list: columns and rows".to_owned(),
            "Span" => "span of time, as in `\"0 s..10 s\"`, `\"95 s..\"` or `\"..2 min\"`".to_owned(),
            "Point" => "length; on a plane a list: along and across".to_owned(),
            "RawQuantity" => "quantity that the sensors measure".to_owned(),
            "ShareOrQuantity" => "share of the range, or quantity that the sensors measure".to_owned(),
            "bool" => "`true` or `false`".to_owned(),
            "String" => "text".to_owned(),
            "i64" => "whole number".to_owned(),
            "IgnoredAny" => "table".to_owned(),
            _ => self.item(file, text).map_or_else(|| text.to_owned(), |item| self.named(item)),
        }
    }

    fn named(&self, item: &Item) -> String {
        match (&item.shape, item.serde.text("expecting")) {
            (_, Some(expecting)) => expecting.strip_prefix("a ").unwrap_or(&expecting).to_owned(),
            (Shape::Enum(variants), None) if !is_by(item, "kind") => {
                let words: Vec<String> =
                    variants.iter().map(|variant| format!("`{}`", item.word(variant))).collect();
                words.join(", ")
            }
            _ => "table".to_owned(),
        }
    }

    fn item(&self, file: &Path, type_text: &str) -> Option<&'a Item> {
        let mut text = type_text.trim();
        while let Some((name, rest)) = text.split_once('<') {
            if !["Option", "At", "Vec", "OneOrMany"].contains(&name) {
                return None;
            }
            text = rest.strip_suffix('>')?;
        }
        self.types.find(file, text)
    }

    fn is_table(&self, item: &Item) -> bool {
        match &item.shape {
            Shape::Struct(_) => true,
            Shape::Tuple => false,
            Shape::Enum(_) if is_by(item, "kind") => true,
            Shape::Enum(variants) => variants
                .iter()
                .filter_map(|variant| variant.holds.as_ref())
                .any(|held| self.item(&item.file, held).is_some_and(|held| self.is_table(held))),
        }
    }

    fn has_words(&self, item: &Item) -> bool {
        match &item.shape {
            Shape::Enum(variants) if is_by(item, "shape") => variants
                .iter()
                .filter_map(|variant| variant.holds.as_ref())
                .any(|held| self.item(&item.file, held).is_some_and(|held| self.has_words(held))),
            Shape::Enum(_) => !is_by(item, "kind"),
            _ => false,
        }
    }
}

pub fn key(field: &Field) -> String {
    field.serde.text("rename").unwrap_or_else(|| field.name.clone())
}

fn is_by(item: &Item, what: &str) -> bool {
    item.serde.text("rename").is_some_and(|name| name.starts_with(&format!("by {what}")))
}

fn quantity(dimension: &str) -> &str {
    match dimension.split(',').next().unwrap_or(dimension) {
        "Number" => "number",
        "Length" => "length",
        "Force" => "force",
        "Modulus" => "modulus",
        "Ratio" => "share",
        "Density" => "density",
        "Stiffness" => "stiffness",
        "RotationalStiffness" => "rotational stiffness",
        "Speed" => "speed",
        "Time" => "time",
        "Frequency" => "frequency",
        other => other,
    }
}

/// Splits "; … by default" off a comment.
pub fn split_default(docs: &str) -> (String, Option<String>) {
    let Some((before, after)) = docs.split_once(" by default") else {
        return (docs.to_owned(), None);
    };
    match before.rsplit_once("; ") {
        Some((meaning, default)) => {
            (format!("{meaning}{after}"), Some(default.trim_end_matches(',').to_owned()))
        }
        None => (docs.to_owned(), None),
    }
}

fn lower(sentence: &str) -> String {
    if sentence.chars().nth(1).is_none_or(|second| second.is_uppercase()) {
        return sentence.to_owned();
    }
    let mut characters = sentence.chars();
    let first = characters.next().map(|first| first.to_lowercase().to_string()).unwrap_or_default();
    first + characters.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_manuals_become_links() {
        let text = "See docs/how-to/stream-to-mqtt.md, docs/images/A.png.";
        let expected = "See [stream to mqtt](../how-to/stream-to-mqtt.md), docs/images/A.png.";
        assert_eq!(linked(text), expected);
    }
}

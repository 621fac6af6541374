//! Structs and enums with doc comments and serde attributes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use syn::ext::IdentExt;
use syn::punctuated::Punctuated;
use syn::spanned::Spanned;
use syn::{Attribute, Expr, Fields, ImplItem, Lit, Meta, MetaList, Token, parenthesized, token};

use crate::rust::{self, FileReferences, UsedPath};

#[derive(Clone, Debug)]
pub struct Item {
    pub name: String,
    /// The `use` declarations of this file resolve the types of the fields.
    pub file: PathBuf,
    pub docs: String,
    pub serde: Serde,
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
    pub serde: Serde,
    pub type_text: String,
}

#[derive(Clone, Debug)]
pub struct Variant {
    pub name: String,
    pub docs: String,
    pub is_default: bool,
    pub fields: Vec<Field>,
    pub holds: Option<String>,
}

/// Arguments of `#[serde(…)]`, with optional texts.
#[derive(Clone, Debug, Default)]
pub struct Serde(BTreeMap<String, Option<String>>);

impl Serde {
    fn of(attributes: &[Attribute]) -> Result<Self> {
        let mut arguments = BTreeMap::new();
        for list in lists(attributes, "serde") {
            list.parse_nested_meta(|argument| {
                let key = argument.path.get_ident().map(ToString::to_string).unwrap_or_default();
                let mut text = None;
                if argument.input.peek(Token![=]) {
                    text = Some(argument.value()?.parse::<syn::LitStr>()?.value());
                } else if argument.input.peek(token::Paren) {
                    let inner;
                    parenthesized!(inner in argument.input);
                    inner.parse::<proc_macro2::TokenStream>()?;
                }
                arguments.insert(key, text);
                Ok(())
            })?;
        }
        Ok(Self(arguments))
    }

    pub fn has(&self, key: &str) -> bool {
        self.0.contains_key(key)
    }

    pub fn text(&self, key: &str) -> Option<String> {
        self.0.get(key).cloned().flatten()
    }
}

impl Item {
    #[cfg(test)]
    pub fn fields(&self) -> Vec<&Field> {
        match &self.shape {
            Shape::Struct(fields) => fields.iter().collect(),
            Shape::Tuple => Vec::new(),
            Shape::Enum(variants) => variants.iter().flat_map(|variant| &variant.fields).collect(),
        }
    }

    pub fn word(&self, variant: &Variant) -> String {
        let style = self.serde.text("rename_all").unwrap_or_default();
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

/// Types of palpate-rig and of the crates that it uses.
pub struct Types {
    items: Vec<Item>,
    files: BTreeMap<PathBuf, Source>,
}

struct Source {
    paths: Vec<UsedPath>,
    constants: BTreeMap<String, String>,
    /// Words of bounds of quantities.
    bounds: BTreeMap<String, String>,
}

const CRATES: [&str; 5] =
    ["palpate-rig", "palpate-core", "palpate-mechanics", "palpate-estimators", "palpate-design"];

impl Types {
    pub fn read(root: &Path) -> Result<Self> {
        let mut files = Vec::new();
        for name in CRATES {
            collect(&root.join("crates").join(name).join("src"), &mut files)?;
        }
        let mut types = Self { items: Vec::new(), files: BTreeMap::new() };
        for path in files {
            let cannot_read = || format!("cannot read {}", path.display());
            let text = fs::read_to_string(&path).with_context(cannot_read)?;
            let file = rust::parse(&text).with_context(cannot_read)?;
            types.items.extend(items(&path, &file).with_context(cannot_read)?);
            types.files.insert(path, Source::of(&file));
        }
        Ok(types)
    }

    pub fn all(&self) -> impl Iterator<Item = &Item> {
        self.items.iter()
    }

    #[cfg(test)]
    pub fn of_rig(&self) -> impl Iterator<Item = &Item> {
        self.items.iter().filter(|item| item.file.components().any(|part| part.as_os_str() == "palpate-rig"))
    }

    /// Resolves `name` in `file`: its own type, or that of a used crate or module.
    pub fn find(&self, file: &Path, name: &str) -> Option<&Item> {
        let named = || self.items.iter().filter(|item| item.name == name);
        let own = named().find(|item| item.file == file);
        let imported = || {
            // `use palpate_mechanics::…` or, within the crate, `use crate::…`.
            let paths = &self.files.get(file)?.paths;
            let path = &paths.iter().find(|path| path.imported.as_deref() == Some(name))?.segments;
            let folder = path.first()?.replace('_', "-");
            let folder = if folder == "crate" { "palpate-rig".to_owned() } else { folder };
            let module = path.get(1)?;
            let mut within =
                named().filter(|item| item.file.components().any(|part| part.as_os_str() == folder.as_str()));
            let path = |item: &&Item| item.file.to_string_lossy().contains(&format!("/{module}"));
            let first = within.clone().find(path);
            first.or_else(|| within.next())
        };
        // A re-exported type of another crate has a unique name.
        own.or_else(imported).or_else(|| named().next().filter(|_| named().count() == 1))
    }

    pub fn constant(&self, file: &Path, name: &str) -> Option<String> {
        Some(self.files.get(file)?.constants.get(name)?.replace('_', ""))
    }

    pub fn bound(&self, name: &str) -> Option<String> {
        let words = self.files.values().find_map(|file| file.bounds.get(name))?;
        let constant = words.rsplit("::").next()?;
        let text = if words.starts_with('"') {
            words
        } else {
            self.files.values().find_map(|file| file.constants.get(constant))?
        };
        Some(text.trim_matches('"').to_owned())
    }
}

impl Source {
    fn of(file: &syn::File) -> Self {
        let mut constants = BTreeMap::new();
        let mut bounds = BTreeMap::new();
        for item in &file.items {
            match item {
                syn::Item::Const(constant) => {
                    constants.insert(constant.ident.to_string(), source_text(&constant.expr));
                }
                syn::Item::Impl(block) => {
                    for item in &block.items {
                        if let ImplItem::Const(constant) = item {
                            let text = source_text(&constant.expr);
                            if constant.ident == "WORDS" {
                                bounds.insert(source_text(&block.self_ty), text.clone());
                            }
                            constants.insert(constant.ident.to_string(), text);
                        }
                    }
                }
                _ => {}
            }
        }
        Self { paths: FileReferences::of(file).paths, constants, bounds }
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

fn items(path: &Path, file: &syn::File) -> Result<Vec<Item>> {
    let mut found = Vec::new();
    for item in &file.items {
        let (name, attributes, shape) = match item {
            syn::Item::Struct(item) => {
                let shape = match &item.fields {
                    Fields::Named(named) => Shape::Struct(fields(&named.named)?),
                    Fields::Unnamed(_) | Fields::Unit => Shape::Tuple,
                };
                (&item.ident, &item.attrs, shape)
            }
            syn::Item::Enum(item) => {
                let variants = item.variants.iter().map(variant).collect::<Result<_>>()?;
                (&item.ident, &item.attrs, Shape::Enum(variants))
            }
            _ => continue,
        };
        if derives_deserialize(attributes) {
            found.push(Item {
                name: name.unraw().to_string(),
                file: path.to_owned(),
                docs: docs(attributes),
                serde: Serde::of(attributes)?,
                shape,
            });
        }
    }
    Ok(found)
}

fn derives_deserialize(attributes: &[Attribute]) -> bool {
    lists(attributes, "derive").iter().any(|list| {
        let mut derives = false;
        let all = list.parse_nested_meta(|derived| {
            derives |= derived.path.segments.last().is_some_and(|last| last.ident == "Deserialize");
            Ok(())
        });
        all.is_ok() && derives
    })
}

/// Attributes `name(…)`, also within `cfg_attr`.
fn lists(attributes: &[Attribute], name: &str) -> Vec<MetaList> {
    let conditional = |attribute: &Attribute| {
        let metas = attribute.parse_args_with(Punctuated::<Meta, Token![,]>::parse_terminated);
        metas.into_iter().flatten().skip(1).collect()
    };
    let metas = attributes.iter().flat_map(|attribute| match attribute.path().is_ident("cfg_attr") {
        true => conditional(attribute),
        false => vec![attribute.meta.clone()],
    });
    let list = |meta| match meta {
        Meta::List(list) if list.path.is_ident(name) => Some(list),
        _ => None,
    };
    metas.filter_map(list).collect()
}

fn fields<'a>(fields: impl IntoIterator<Item = &'a syn::Field>) -> Result<Vec<Field>> {
    let field = |field: &syn::Field| {
        let name = field.ident.as_ref().map(|ident| ident.unraw().to_string()).unwrap_or_default();
        let (docs, serde) = (docs(&field.attrs), Serde::of(&field.attrs)?);
        Ok(Field { name, docs, serde, type_text: source_text(&field.ty) })
    };
    fields.into_iter().map(field).collect()
}

fn variant(variant: &syn::Variant) -> Result<Variant> {
    let (own, holds) = match &variant.fields {
        Fields::Named(named) => (fields(&named.named)?, None),
        Fields::Unnamed(unnamed) => {
            let mut types = unnamed.unnamed.iter().map(|field| source_text(&field.ty));
            (Vec::new(), types.next().filter(|_| types.next().is_none()))
        }
        Fields::Unit => (Vec::new(), None),
    };
    Ok(Variant {
        name: variant.ident.to_string(),
        docs: docs(&variant.attrs),
        is_default: variant.attrs.iter().any(|attribute| attribute.path().is_ident("default")),
        fields: own,
        holds,
    })
}

fn docs(attributes: &[Attribute]) -> String {
    let line = |attribute: &Attribute| match &attribute.meta {
        Meta::NameValue(doc) if doc.path.is_ident("doc") => match &doc.value {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => Some(text.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    };
    attributes.iter().filter_map(line).collect::<Vec<_>>().join(" ")
}

fn source_text(node: &impl Spanned) -> String {
    let text = node.span().source_text().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items_of(text: &str) -> Vec<Item> {
        items(Path::new("a.rs"), &rust::parse(text).unwrap()).unwrap()
    }

    #[test]
    fn structs_have_their_docs_types_and_serde_arguments() {
        let items = items_of(
            "/// One\n/// two.\n#[derive(Debug, serde::Deserialize)]\n#[serde(default, rename = \"by \\\"kind\\\"\")]\n\
             pub(crate) struct A {\n/// A key.\n#[serde(default = \"yes\")] pub r#type: Option<\n At<Vec<B>>>,\n}\n\
             #[derive(Debug)] struct B { c: u8 }",
        );
        let [a] = items.as_slice() else { panic!("{items:?}") };
        assert_eq!((a.name.as_str(), a.docs.as_str()), ("A", "One two."));
        assert!(a.serde.has("default") && a.serde.text("default").is_none());
        assert_eq!(a.serde.text("rename").as_deref(), Some("by \"kind\""));
        let [field] = a.fields()[..] else { panic!("{a:?}") };
        assert_eq!((field.name.as_str(), field.docs.as_str()), ("type", "A key."));
        assert_eq!(field.type_text, "Option< At<Vec<B>>>");
        assert_eq!(field.serde.text("default").as_deref(), Some("yes"));
    }

    #[test]
    fn conditional_attributes_count() {
        let items = items_of(
            "#[cfg_attr(feature = \"serde\", derive(serde::Deserialize), serde(rename_all = \"kebab-case\"))]\n\
             enum A { OneWord }",
        );
        assert_eq!(items[0].serde.text("rename_all").as_deref(), Some("kebab-case"));
    }

    #[test]
    fn enums_have_words_defaults_and_contents() {
        let items = items_of(
            "#[derive(Deserialize)]\n#[serde(rename_all = \"kebab-case\", bound(deserialize = \"T: A\"))]\n\
             enum A { #[default] OneWord, /// Held.\nHolds(B), Two(B, C), Own { d: u8 } }",
        );
        let Shape::Enum(variants) = &items[0].shape else { panic!("{items:?}") };
        let words: Vec<String> = variants.iter().map(|variant| items[0].word(variant)).collect();
        assert_eq!(words, ["one-word", "holds", "two", "own"]);
        assert!(variants[0].is_default && !variants[1].is_default);
        assert_eq!((variants[1].docs.as_str(), variants[1].holds.as_deref()), ("Held.", Some("B")));
        assert_eq!((variants[2].holds.as_deref(), variants[3].fields.len()), (None, 1));
    }
}

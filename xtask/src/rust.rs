//! Paths, module declarations and comments of Rust source.

use std::ops::Range;

use anyhow::{Result, anyhow};
use proc_macro2::{Delimiter, LineColumn, Spacing, Span, TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, Field, ImplItem, Item, ItemMod, ItemUse, Local, Macro, Path, TraitItem, UseTree};

/// A path; groups such as `a::{b, c}` are expanded.
#[derive(Debug, PartialEq, Eq)]
pub struct UsedPath {
    /// From 1.
    pub line: usize,
    /// With `*`, but without a final `self`.
    pub segments: Vec<String>,
    pub imported: Option<String>,
}

#[derive(Debug, Default)]
pub struct FileReferences {
    /// Paths in expressions, types, `use` declarations and macro arguments.
    pub paths: Vec<UsedPath>,
    /// Modules in files: `mod name;`.
    pub modules: Vec<String>,
}

impl FileReferences {
    pub fn of(file: &syn::File) -> Self {
        let mut uses = Self::default();
        uses.visit_file(file);
        uses
    }

    fn add_use(&mut self, before: &[String], tree: &UseTree, line: usize) {
        let with = |name: String| [before, &[name]].concat();
        match tree {
            UseTree::Path(path) => self.add_use(&with(path.ident.to_string()), &path.tree, line),
            UseTree::Name(name) if name.ident == "self" => self.import(before.to_vec(), None, line),
            UseTree::Name(name) => self.import(with(name.ident.to_string()), None, line),
            UseTree::Rename(name) if name.ident == "self" => {
                self.import(before.to_vec(), Some(name.rename.to_string()), line);
            }
            UseTree::Rename(name) => {
                self.import(with(name.ident.to_string()), Some(name.rename.to_string()), line);
            }
            UseTree::Glob(_) => self.import(with("*".into()), None, line),
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.add_use(before, tree, line_of_tree(tree)));
            }
        }
    }

    fn import(&mut self, segments: Vec<String>, renamed: Option<String>, line: usize) {
        let imported = renamed.or_else(|| segments.last().cloned());
        self.paths.push(UsedPath { line, segments, imported });
    }

    /// Adds names joined by `::` among tokens that syn does not parse.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let mut path = Vec::new();
        let (mut line, mut colons) = (0, 0);
        for token in tokens {
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => {
                    colons += 1;
                    // A single colon ends a path: `name: value`.
                    if colons == 1 && punct.spacing() == Spacing::Alone {
                        self.end_path(&mut path, line);
                    }
                }
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.end_path(&mut path, line);
                    }
                    if path.is_empty() {
                        line = ident.span().start().line;
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                TokenTree::Group(group) => {
                    self.end_path(&mut path, line);
                    self.add_tokens(group.stream());
                    colons = 0;
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => {
                    self.end_path(&mut path, line);
                    colons = 0;
                }
            }
        }
        self.end_path(&mut path, line);
    }

    fn end_path(&mut self, path: &mut Vec<String>, line: usize) {
        if !path.is_empty() {
            self.paths.push(UsedPath { line, segments: std::mem::take(path), imported: None });
        }
    }
}

impl<'ast> Visit<'ast> for FileReferences {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Const(item) => &item.attrs,
            Item::Enum(item) => &item.attrs,
            Item::ExternCrate(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::ForeignMod(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Macro(item) => &item.attrs,
            Item::Mod(item) => &item.attrs,
            Item::Static(item) => &item.attrs,
            Item::Struct(item) => &item.attrs,
            Item::Trait(item) => &item.attrs,
            Item::TraitAlias(item) => &item.attrs,
            Item::Type(item) => &item.attrs,
            Item::Union(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_for_tests(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item(&mut self, item: &'ast ImplItem) {
        let attributes: &[Attribute] = match item {
            ImplItem::Const(item) => &item.attrs,
            ImplItem::Fn(item) => &item.attrs,
            ImplItem::Type(item) => &item.attrs,
            ImplItem::Macro(item) => &item.attrs,
            _ => &[],
        };
        if !is_for_tests(attributes) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_trait_item(&mut self, item: &'ast TraitItem) {
        let attributes: &[Attribute] = match item {
            TraitItem::Const(item) => &item.attrs,
            TraitItem::Fn(item) => &item.attrs,
            TraitItem::Type(item) => &item.attrs,
            TraitItem::Macro(item) => &item.attrs,
            _ => &[],
        };
        if !is_for_tests(attributes) {
            visit::visit_trait_item(self, item);
        }
    }

    fn visit_field(&mut self, field: &'ast Field) {
        if !is_for_tests(&field.attrs) {
            visit::visit_field(self, field);
        }
    }

    fn visit_local(&mut self, local: &'ast Local) {
        if !is_for_tests(&local.attrs) {
            visit::visit_local(self, local);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.add_use(&[], &item.tree, line_of_tree(&item.tree));
    }

    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        if module.content.is_none() {
            self.modules.push(module.ident.to_string());
        }
        visit::visit_item_mod(self, module);
    }

    fn visit_path(&mut self, path: &'ast Path) {
        if let Some(first) = path.segments.first() {
            let segments = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.paths.push(UsedPath { line: first.ident.span().start().line, segments, imported: None });
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.visit_path(&call.path);
        self.add_tokens(call.tokens.clone());
    }
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|condition| condition == "test")
    })
}

fn line_of_tree(tree: &UseTree) -> usize {
    let span = match tree {
        UseTree::Path(path) => path.ident.span(),
        UseTree::Name(name) => name.ident.span(),
        UseTree::Rename(name) => name.ident.span(),
        UseTree::Glob(glob) => glob.star_token.spans[0],
        UseTree::Group(group) => group.brace_token.span.open(),
    };
    span.start().line
}

pub fn parse(text: &str) -> Result<syn::File> {
    syn::parse_file(text).map_err(|error| at(error.span(), &error))
}

/// Returns all comments of a file; the rest is blank, and lines keep their numbers.
pub fn comments(text: &str) -> Result<String> {
    let tokens: TokenStream =
        text.parse().map_err(|error: proc_macro2::LexError| at(error.span(), &error))?;
    let mut code = Vec::new();
    add_code(tokens, &mut code);
    let mut left = text.as_bytes().to_vec();
    for range in code {
        left[range].iter_mut().filter(|byte| **byte != b'\n').for_each(|byte| *byte = b' ');
    }
    Ok(String::from_utf8(left)?)
}

/// Adds the byte ranges of tokens other than doc comments.
fn add_code(tokens: TokenStream, code: &mut Vec<Range<usize>>) {
    let is_comment = |span: Span| span.source_text().is_some_and(|text| text.starts_with(['/']));
    for token in tokens {
        match token {
            TokenTree::Group(group) if is_comment(group.span()) => {}
            TokenTree::Group(group) => {
                if group.delimiter() != Delimiter::None {
                    code.extend([group.span_open().byte_range(), group.span_close().byte_range()]);
                }
                add_code(group.stream(), code);
            }
            // `/` itself begins a token that is not a comment.
            TokenTree::Punct(punct) if punct.as_char() != '#' && punct.as_char() != '!' => {
                code.push(punct.span().byte_range());
            }
            token if is_comment(token.span()) => {}
            token => code.push(token.span().byte_range()),
        }
    }
}

fn at(span: Span, error: &dyn std::error::Error) -> anyhow::Error {
    let LineColumn { line, column } = span.start();
    anyhow!("line {line}, column {}: {error}", column + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uses(code: &str) -> FileReferences {
        FileReferences::of(&parse(code).unwrap())
    }

    fn paths(code: &str) -> Vec<String> {
        let joined = uses(code).paths.into_iter().map(|path| path.segments.join("::"));
        joined.filter(|path| path.contains("::")).collect()
    }

    fn words(text: &str) -> Vec<&str> {
        text.split_whitespace().collect()
    }

    #[test]
    fn groups_are_taken_apart() {
        assert_eq!(
            paths("use std::{fs, time::{Duration, Instant}, io::*};\nuse crate::units as u;"),
            ["std::fs", "std::time::Duration", "std::time::Instant", "std::io::*", "crate::units"]
        );
    }

    #[test]
    fn paths_inside_expressions_types_and_macros_are_found() {
        assert_eq!(
            paths(
                "fn f() { let a: Vec::<crate::rig::Rig> = ::std::fs::read(x)?; match e { Kind::A { b } => b * Kind::C } \
                 assert!(super::beam::bend(a: 3, [crate::plate::Mesh]), \"a::b\"); }"
            ),
            [
                "crate::rig::Rig",
                "std::fs::read",
                "Kind::A",
                "Kind::C",
                "super::beam::bend",
                "crate::plate::Mesh"
            ]
        );
    }

    #[test]
    fn lines_imported_names_and_declared_modules_are_found() {
        let FileReferences { paths, .. } =
            uses("\n\nuse a::{self, b as c, d::{e, self}};\nfn f() { let f = a::b as u8; }");
        let found: Vec<_> = paths.iter().map(|path| (path.line, path.imported.as_deref())).collect();
        let (a, c, e, d) = (Some("a"), Some("c"), Some("e"), Some("d"));
        assert_eq!(found[..4], [(3, a), (3, c), (3, e), (3, d)]);
        assert!(found[4..].iter().all(|(line, imported)| *line == 4 && imported.is_none()), "{found:?}");
        assert_eq!(uses("pub mod a;\nmod b { mod c; }\nconst MODEL: u8 = d;").modules, ["a", "c"]);
    }

    #[test]
    fn tests_are_left_out() {
        let source = "fn a() { x::a() }\n#[cfg(test)]\nmod tests {\n fn b() { if x { y::b } }\n}\nfn c() { x::c() }\n\
                      #[cfg(test)]\nuse d::d;\n#[cfg(test)]\nmod d;\nstruct E { #[cfg(test)] f: x::f, g: x::g }\n\
                      impl E { #[cfg(test)] fn h() { x::h() } }";
        assert_eq!(paths(source), ["x::a", "x::c", "x::g"]);
        assert_eq!(uses(source).modules, [] as [&str; 0]);
    }

    #[test]
    fn comments_keep_their_lines_and_code_is_blank() {
        let source = "//! a\nlet a = \"one // two\"; // three\n/* four /* five */ six */ let b = '/'; b / c;\n/// seven\nfn f() {}";
        let text = comments(source).unwrap();
        assert_eq!(words(&text), words("//! a // three /* four /* five */ six */ /// seven"));
        assert_eq!(
            text.lines().map(str::len).collect::<Vec<_>>(),
            source.lines().map(str::len).collect::<Vec<_>>()
        );
    }

    #[test]
    fn literals_and_raw_identifiers_are_no_comments() {
        let source = r##"let q = '"'; let e = '\''; let s = "\"in//\""; let r#type = br"//"; let t: &'a u8 = b"//"; #[doc = "//"] x"##;
        assert_eq!(words(&comments(source).unwrap()), [] as [&str; 0]);
    }

    #[test]
    fn text_that_is_not_rust_is_an_error_with_its_place() {
        for source in ["fn f() {\n  \"open", "fn f() {\n  r#\"open"] {
            let error = comments(source).unwrap_err().to_string();
            assert!(error.starts_with("line "), "{error}");
            assert!(parse(source).is_err());
        }
        let error = parse("use a::{b,\n  c:: d{").map(|_| ()).unwrap_err().to_string();
        assert!(error.starts_with("line "), "{error}");
    }
}

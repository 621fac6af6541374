//! Changes to the project's TOML files, which fail when the place to change is not there.

use std::fmt;

use toml_edit::{DocumentMut, Item, Value};

/// A TOML file whose values are named by their path: `sensors.count`, or `sensors.1.noise` in an array of tables.
pub struct Toml(DocumentMut);

impl Toml {
    /// Parses a file.
    pub fn parse(text: &str) -> Self {
        Self(text.parse().expect("valid TOML"))
    }

    /// Changes a value; its comment stays.
    pub fn set(mut self, path: &str, value: impl Into<Value>) -> Self {
        let old = self.item(path).as_value_mut().unwrap_or_else(|| panic!("{path} is a table"));
        let decor = old.decor().clone();
        *old = value.into();
        *old.decor_mut() = decor;
        self
    }

    /// Adds a value to a table.
    pub fn add(mut self, path: &str, value: impl Into<Value>) -> Self {
        let (table, key) = self.place(path);
        let table = table.as_table_like_mut().unwrap_or_else(|| panic!("{path} is in no table"));
        let before = table.insert(key, Item::Value(value.into()));
        assert!(before.is_none(), "{path} exists already");
        self
    }

    /// Removes a value, a table, or a table of an array.
    pub fn remove(mut self, path: &str) -> Self {
        let (table, key) = self.place(path);
        if let Some(tables) = table.as_array_of_tables_mut() {
            tables.remove(key.parse().unwrap_or_else(|_| panic!("{path} is not named by a number")));
        } else {
            let removed = table.as_table_like_mut().and_then(|table| table.remove(key));
            assert!(removed.is_some(), "nothing at {path}");
        }
        self
    }

    /// Takes another estimator, with its defaults.
    pub fn estimator(mut self, kind: &str) -> Self {
        self.item("estimator").as_table_like_mut().expect("a table").clear();
        self.add("estimator.kind", kind)
    }

    /// Keeps the arms of a study with these names, of which there must be some.
    pub fn keep_arms(mut self, wanted: impl Fn(&str) -> bool) -> Self {
        let arms = self.item("arm").as_array_of_tables_mut().expect("an array of tables");
        arms.retain(|arm| wanted(arm["name"].as_str().expect("a name")));
        assert!(!arms.is_empty(), "no arm of such a name");
        self
    }

    /// The text at a path.
    pub fn text_at(&mut self, path: &str) -> String {
        self.item(path).as_str().unwrap_or_else(|| panic!("no text at {path}")).to_owned()
    }

    fn item(&mut self, path: &str) -> &mut Item {
        path.split('.').fold(self.0.as_item_mut(), |item, key| {
            let found = match key.parse::<usize>() {
                Ok(index) => item.get_mut(index),
                Err(_) => item.get_mut(key),
            };
            found.unwrap_or_else(|| panic!("no {key} of {path}"))
        })
    }

    /// Item that holds the last segment of a path, and that segment.
    fn place<'p>(&mut self, path: &'p str) -> (&mut Item, &'p str) {
        match path.rsplit_once('.') {
            Some((table, key)) => (self.item(table), key),
            None => (self.0.as_item_mut(), path),
        }
    }
}

impl fmt::Display for Toml {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A text with the first of `from` replaced, which may leave a file that is none.
pub fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "no {from:?} to replace");
    text.replacen(from, to, 1)
}

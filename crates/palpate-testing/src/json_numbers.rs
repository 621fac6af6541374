//! Numbers of a JSON document, to be put wrong one by one.

use serde_json::Value;

/// Numbers that break code without checks: zero, nearly zero, too many, too large, of the other sign.
pub const HOSTILE: [&str; 10] = [
    "0",
    "-0.0",
    "1e-320",
    "1e-200",
    "1e308",
    "-1e308",
    "1e18",
    "-1",
    "1000000000000000000",
    "18446744073709551615",
];

/// A number's place in a document, as people write it: `locator.method.rows[3].x_m`.
pub type Path = String;

/// All numbers of a document in its order, each with its path.
pub fn numbers(document: &mut Value) -> Vec<(Path, &mut Value)> {
    let mut found = Vec::new();
    collect(document, String::new(), usize::MAX, &mut found);
    found
}

/// The numbers of a document, of every list the first, the middle and the last element only.
pub fn some_numbers(document: &mut Value) -> Vec<(Path, &mut Value)> {
    let mut found = Vec::new();
    collect(document, String::new(), 3, &mut found);
    found
}

fn collect<'a>(value: &'a mut Value, path: Path, most: usize, found: &mut Vec<(Path, &'a mut Value)>) {
    match value {
        Value::Number(_) => found.push((path, value)),
        Value::Array(items) => {
            let count = items.len();
            let is_looked_at = |i: usize| count <= most || i == 0 || i == count / 2 || i == count - 1;
            for (i, item) in items.iter_mut().enumerate().filter(|(i, _)| is_looked_at(*i)) {
                collect(item, format!("{path}[{i}]"), most, found);
            }
        }
        Value::Object(fields) => {
            for (name, field) in fields {
                collect(field, format!("{path}.{name}"), most, found);
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

//! Numbers of a JSON document, for tests with invalid values.

use serde_json::Value;

/// Numbers that break unchecked code.
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

/// Path of a number: `locator.method.rows[3].x_m`.
pub type Path = String;

/// Lists all numbers in order, with their paths.
pub fn numbers(document: &mut Value) -> Vec<(Path, &mut Value)> {
    let mut found = Vec::new();
    collect(document, String::new(), usize::MAX, &mut found);
    found
}

/// Lists the numbers; of each list only first, middle and last element.
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

//! Login at a broker.

use std::fmt::{self, Write};
use std::path::PathBuf;

/// Environment variable of the password.
pub const PASSWORD_VARIABLE: &str = "PALPATE_MQTT_PASSWORD";

/// User and password, which `Display` and `Debug` omit.
#[derive(Clone, PartialEq, Eq)]
pub struct Login {
    user: String,
    password: Password,
}

#[derive(Clone, PartialEq, Eq)]
enum Password {
    Given(String),
    File(PathBuf),
    Environment,
}

/// Error of a login.
#[derive(Debug, thiserror::Error)]
pub enum LoginError {
    /// The password file cannot be read.
    #[error("cannot read the password in {path}: {error}")]
    File {
        /// File.
        path: String,
        /// Cause.
        error: std::io::Error,
    },
}

impl Login {
    /// Parses a percent-encoded `user` or `user:password`.
    ///
    /// # Errors
    /// The problem, without the password.
    pub fn parse(text: &str, file: Option<&str>) -> Result<Self, &'static str> {
        let (user, password) = match text.split_once(':') {
            Some((user, password)) => (user, Some(password)),
            None => (text, None),
        };
        const PERCENT: &str =
            "in user name and password `%` must begin two hexadecimal digits, as in `%40` for `@`";
        let user = decoded(user).ok_or(PERCENT)?;
        if user.is_empty() {
            return Err("the user name before `@` is empty");
        }
        let password = match (password, file) {
            (Some(_), Some(_)) => return Err("the password is given twice: in the URL and in a file"),
            (Some(password), None) => Password::Given(decoded(password).ok_or(PERCENT)?),
            (None, Some(file)) => Password::File(file.into()),
            (None, None) => Password::Environment,
        };
        Ok(Self { user, password })
    }

    /// User and password; the latter is empty for an unset environment variable.
    ///
    /// # Errors
    /// An unreadable file.
    pub fn credentials(&self) -> Result<(String, String), LoginError> {
        let password = match &self.password {
            Password::Given(password) => password.clone(),
            Password::Environment => std::env::var(PASSWORD_VARIABLE).unwrap_or_default(),
            Password::File(path) => {
                let text = std::fs::read_to_string(path)
                    .map_err(|error| LoginError::File { path: path.display().to_string(), error })?;
                text.trim_end_matches(['\r', '\n']).to_owned()
            }
        };
        Ok((self.user.clone(), password))
    }

    /// Password file.
    pub fn file(&self) -> Option<String> {
        match &self.password {
            Password::File(path) => Some(path.display().to_string()),
            Password::Given(_) | Password::Environment => None,
        }
    }
}

/// Percent-encoded user name.
impl fmt::Display for Login {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.user.bytes().try_for_each(|byte| match byte {
            _ if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) => f.write_char(char::from(byte)),
            _ => write!(f, "%{byte:02X}"),
        })
    }
}

impl fmt::Debug for Login {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Login").field("user", &self.user).finish_non_exhaustive()
    }
}

fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?].map(char::from);
                let [high, low] = digits.map(|digit| digit.to_digit(16));
                u8::try_from(16 * high? + low?).ok()?
            }
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

/// Hides the passwords of URLs: `mqtt://user:***@host`.
pub fn without_passwords(message: &str) -> String {
    let mut shown = String::new();
    let mut rest = message;
    while let Some(start) = rest.find("://") {
        let (before, after) = rest.split_at(start + 3);
        shown.push_str(before);
        let end = after
            .find(|letter: char| letter.is_whitespace() || "`'\"".contains(letter))
            .unwrap_or(after.len());
        let url = &after[..end];
        match (url.find(':'), url.rfind('@')) {
            (Some(colon), Some(at)) if colon < at => {
                shown.push_str(&url[..=colon]);
                shown.push_str("***");
                shown.push_str(&url[at..]);
            }
            _ => shown.push_str(url),
        }
        rest = &after[end..];
    }
    shown + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logins_are_percent_decoded_and_passwords_hidden() {
        let login = Login::parse("me%40lab:p%2Fw:x", None).unwrap();
        assert_eq!(login.credentials().unwrap(), ("me@lab".to_owned(), "p/w:x".to_owned()));
        assert_eq!(login.to_string(), "me%40lab");
        assert!(!format!("{login:?}").contains("p/w"), "{login:?}");
        for wrong in [":secret", "me:%4", "me:%zz", "me:%FF"] {
            assert!(!Login::parse(wrong, None).unwrap_err().contains("secret"), "{wrong}");
        }
        assert!(Login::parse("me:secret", Some("file")).is_err());
    }

    #[test]
    fn passwords_are_read_from_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("password");
        std::fs::write(&path, "secret\n").unwrap();
        let login = Login::parse("me", path.to_str()).unwrap();
        assert_eq!(login.credentials().unwrap().1, "secret");
        let missing = Login::parse("me", folder.path().join("none").to_str()).unwrap();
        assert!(missing.credentials().unwrap_err().to_string().contains("cannot read the password"));
    }

    #[test]
    fn messages_lose_the_passwords_of_urls() {
        for (message, shown) in [
            ("invalid value 'mqtt://me:se@cr/et@h/t' for", "invalid value 'mqtt://me:***@h/t' for"),
            ("`mqtt://me@h:1/t` and tcp://h:5", "`mqtt://me@h:1/t` and tcp://h:5"),
            ("no URL", "no URL"),
        ] {
            assert_eq!(without_passwords(message), shown);
        }
    }
}

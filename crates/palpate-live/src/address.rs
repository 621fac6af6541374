use std::fmt;

/// Host and port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Name or address; IPv6 without brackets.
    pub host: String,
    /// Port, from 1.
    pub port: u16,
}

impl Address {
    pub(crate) fn read(text: &str, port: Option<u16>, example: Option<&str>) -> Result<Self, String> {
        let ends = text.rfind(']').map_or(0, |end| end + 1);
        let (host, given) = match text[ends..].rfind(':') {
            Some(colon) => (&text[..ends + colon], Some(&text[ends + colon + 1..])),
            None => (text, None),
        };
        let port = match given {
            Some(given) => {
                let number = given
                    .parse()
                    .ok()
                    .filter(|port| *port > 0 && given.bytes().all(|byte| byte.is_ascii_digit()));
                number.ok_or_else(|| format!("port `{given}` must be a whole number of 1 to 65535"))?
            }
            None => port.ok_or_else(|| format!("`{text}` has no port; write `{text}:5000`"))?,
        };
        let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
        let host = match bare {
            Some(bare) if bare.parse::<std::net::Ipv6Addr>().is_err() => {
                return Err(format!("`{bare}` must be an address of IPv6, as it stands in brackets"));
            }
            Some(bare) => bare,
            None => host,
        };
        if let (true, Some(example)) = (host.is_empty(), example) {
            return Err(format!("the host is missing; write {example}"));
        }
        let odd = |c: char| !(c.is_alphanumeric() || matches!(c, '.' | '-' | '_'));
        if let (None, Some(odd)) = (bare, host.chars().find(|c| odd(*c))) {
            return Err(format!(
                "host `{host}` has `{odd}`; a host is a name, or an address, of IPv6 in brackets"
            ));
        }
        Ok(Self { host: host.to_owned(), port })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port } = self;
        if host.contains(':') { write!(f, "[{host}]:{port}") } else { write!(f, "{host}:{port}") }
    }
}

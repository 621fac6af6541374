use std::fmt;
use std::str::FromStr;

/// Zenoh router and ROS names: `tcp/host:7447?domain=0&name=palpate&frame=surface`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RosUrl {
    /// Router: `tcp/host:7447`.
    pub router: String,
    /// ROS domain, 0 to 232.
    pub domain: u8,
    /// Namespace and name of the node; the default is `palpate`.
    pub name: String,
    /// Frame of points and wrenches; the default is `surface`.
    pub frame: String,
}

/// Error of a URL.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a Zenoh router with names of ROS, as in `tcp/host:7447?domain=0&name=palpate&frame=surface`: {problem}"
)]
pub struct RosUrlError {
    /// Text.
    pub text: String,
    /// Problem.
    pub problem: &'static str,
}

const PORT: u16 = 7447;
const GREATEST_DOMAIN: u8 = 232;
const LONGEST: usize = 200;

impl FromStr for RosUrl {
    type Err = RosUrlError;

    fn from_str(text: &str) -> Result<Self, RosUrlError> {
        parse(text).map_err(|problem| RosUrlError { text: text.to_owned(), problem })
    }
}

impl fmt::Display for RosUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { router, domain, name, frame } = self;
        write!(f, "{router}?domain={domain}&name={name}&frame={frame}")
    }
}

fn parse(text: &str) -> Result<RosUrl, &'static str> {
    let (router, query) = text.split_once('?').unwrap_or((text, ""));
    let (mut domain, mut name, mut frame) = (None, None, None);
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let (key, value) = pair.split_once('=').ok_or("a parameter has no value; write `domain=0`")?;
        let said_before = match key {
            "domain" => domain.replace(domain_of(value)?).is_some(),
            "name" => name.replace(name_of(value)?).is_some(),
            "frame" => frame.replace(frame_of(value)?).is_some(),
            _ => return Err("its parameters are domain, name and frame"),
        };
        if said_before {
            return Err("a parameter is given twice");
        }
    }
    Ok(RosUrl {
        router: router_of(router)?,
        domain: domain.unwrap_or(0),
        name: name.unwrap_or_else(|| "palpate".to_owned()),
        frame: frame.unwrap_or_else(|| "surface".to_owned()),
    })
}

fn router_of(text: &str) -> Result<String, &'static str> {
    let address = text.strip_prefix("tcp/").ok_or("it does not begin with tcp/")?;
    // The colons of an IPv6 address are within brackets.
    let (host, port) = match address.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (
            host,
            port.parse().ok().filter(|&port| port > 0).ok_or("its port is not a number from 1 to 65535")?,
        ),
        _ => (address, PORT),
    };
    let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
    let is_address = bare.is_some_and(|bare| bare.parse::<std::net::Ipv6Addr>().is_ok());
    let is_name = !host.is_empty()
        && host.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_'));
    if !is_address && !is_name {
        return Err("its host is neither a name, nor an address; one of IPv6 has brackets");
    }
    Ok(format!("tcp/{host}:{port}"))
}

fn domain_of(text: &str) -> Result<u8, &'static str> {
    let domain = text.parse().ok().filter(|domain| *domain <= GREATEST_DOMAIN);
    domain.ok_or("its domain is not a number from 0 to 232")
}

fn name_of(text: &str) -> Result<String, &'static str> {
    let is_part = |part: &str| {
        part.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
            && !part.contains("__")
    };
    if text.len() > LONGEST || !text.split('/').all(is_part) {
        return Err(
            "its name has other than letters, digits, single _ and / between parts, or more than 200 of them, \
                    or a part that begins with a digit",
        );
    }
    Ok(text.to_owned())
}

fn frame_of(text: &str) -> Result<String, &'static str> {
    let is_good = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.' | b'/');
    if text.is_empty() || text.len() > LONGEST || text.starts_with('/') || !text.bytes().all(is_good) {
        return Err("its frame has other than 1 to 200 letters, digits and _ - . /, or begins with /");
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn routers_and_names_are_read_and_have_defaults() {
        let url: RosUrl = "tcp/robot.local".parse().unwrap();
        assert_eq!(url.to_string(), "tcp/robot.local:7447?domain=0&name=palpate&frame=surface");
        let text = "tcp/[::1]:7448?domain=232&name=bench/left_1&frame=bench.left/top-1";
        let url: RosUrl = text.parse().unwrap();
        assert_eq!((url.router.as_str(), url.domain), ("tcp/[::1]:7448", 232));
        assert_eq!(url.to_string(), text);
        assert_eq!("tcp/[fe80::1]".parse::<RosUrl>().unwrap().router, "tcp/[fe80::1]:7447");
    }

    #[test]
    fn invalid_urls_are_refused() {
        for (wrong, what) in [
            ("", "tcp/"),
            ("udp/h:1", "tcp/"),
            ("tcp/", "host"),
            ("tcp/:7447", "host"),
            ("tcp/h:0", "port"),
            ("tcp/h:99999", "port"),
            ("tcp/::1", "brackets"),
            ("tcp/h#iface=eth0", "host"),
            ("tcp/h,tcp/i", "host"),
            ("tcp/h?domain=233", "0 to 232"),
            ("tcp/h?domain=-1", "0 to 232"),
            ("tcp/h?domain=", "0 to 232"),
            ("tcp/h?domain", "no value"),
            ("tcp/h?domain=1&domain=1", "twice"),
            ("tcp/h?topic=a", "domain, name and frame"),
            ("tcp/h?name=", "name"),
            ("tcp/h?name=/a", "name"),
            ("tcp/h?name=a//b", "name"),
            ("tcp/h?name=1a", "name"),
            ("tcp/h?name=a__b", "name"),
            ("tcp/h?name=a*", "name"),
            ("tcp/h?name=a\u{0}", "name"),
            ("tcp/h?frame=", "frame"),
            ("tcp/h?frame=/map", "frame"),
            ("tcp/h?frame=a b", "frame"),
        ] {
            let error = wrong.parse::<RosUrl>().unwrap_err();
            assert!(error.problem.contains(what), "{wrong}: {error}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_refused_or_read_again_as_it_is_written(
            text in "(tcp/)?[a-z\\[\\]:.0-9]{0,12}(\\?(domain|name|frame)?=?[^&]{0,9}(&(domain|name|frame)=\\PC{0,9})?)?"
        ) {
            if let Ok(url) = text.parse::<RosUrl>() {
                prop_assert_eq!(url.to_string().parse::<RosUrl>(), Ok(url));
            }
        }
    }
}

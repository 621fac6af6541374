use crate::address::Address;
use crate::broker::broker_and_login;
use crate::login::{Login, without_passwords};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// URL of a source.
#[derive(Clone, Debug, PartialEq)]
pub enum SourceUrl {
    /// `-`: standard input.
    Stdin,
    /// `file:recording.mcap?speed=1`: a recording.
    File {
        /// Recording.
        path: PathBuf,
        /// Speed of the replay; 0 is the fastest.
        speed: f64,
    },
    /// `serial:///dev/ttyACM0?baud=115200`: a serial port.
    Serial {
        /// Path of the port, on Windows its name.
        port: PathBuf,
        /// Bits per second.
        baud: u32,
        /// Names of the values.
        columns: Vec<String>,
    },
    /// `tcp://host:port`: a server of frames.
    Tcp {
        /// Server.
        server: Address,
        /// Names of the values.
        columns: Vec<String>,
    },
    /// `udp://:port`: datagrams.
    Udp {
        /// Local address; all IPv4 addresses without a host.
        at: Address,
        /// Names of the values.
        columns: Vec<String>,
    },
    /// `mqtt://host[:port]/topic`: an MQTT broker.
    Mqtt {
        /// Broker.
        broker: Address,
        /// User name and password.
        login: Option<Login>,
        /// Topic or filter.
        topic: String,
        /// Names of the values.
        columns: Vec<String>,
    },
    /// `simulated:rig.toml?rate=1000&seed=0`: a simulated board.
    Simulated {
        /// Rig.
        rig: PathBuf,
        /// Readings per second.
        rate_hz: f64,
        /// Seed of noise and finger.
        seed: u64,
    },
}

const BAUD: u32 = 115_200;
const GREATEST_BAUD: u32 = 20_000_000;
const FASTEST: f64 = 1e6;

/// Error of a URL.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SourceUrlError {
    /// Unknown scheme.
    #[error(
        "`{text}` is not a source; sources are `-`, `serial:///dev/ttyACM0?baud=115200`, `tcp://host:port`, `udp://:port`, \
         `mqtt://user@host/topic`, `file:recording.mcap?speed=1` and `simulated:rig.toml?rate=1000`"
    )]
    Scheme {
        /// Text.
        text: String,
    },
    /// Invalid part or value.
    #[error("`{text}`: {problem}")]
    Parameter {
        /// URL.
        text: String,
        /// Problem, with the allowed values.
        problem: String,
    },
}

impl SourceUrl {
    /// Names of the values of frames without names; empty for the order of the channels.
    pub fn columns(&self) -> &[String] {
        match self {
            Self::Serial { columns, .. }
            | Self::Tcp { columns, .. }
            | Self::Udp { columns, .. }
            | Self::Mqtt { columns, .. } => columns,
            Self::Stdin | Self::File { .. } | Self::Simulated { .. } => &[],
        }
    }

    fn parse(text: &str) -> Result<Option<Self>, String> {
        let (body, query) = text.split_once('?').unwrap_or((text, ""));
        let mut query = Query(query.split('&').filter(|pair| !pair.is_empty()).collect());
        let url = if body == "-" {
            Self::Stdin
        } else if let Some(port) = body.strip_prefix("serial://") {
            if port.is_empty() {
                return Err("the port is missing; write `serial:///dev/ttyACM0`".to_owned());
            }
            let baud = query.take(
                "baud",
                BAUD,
                |baud| (1..=GREATEST_BAUD).contains(baud),
                "a whole number of 1 to 20000000",
            )?;
            Self::Serial { port: port.into(), baud, columns: query.columns()? }
        } else if let Some(server) = body.strip_prefix("tcp://") {
            Self::Tcp {
                server: Address::read(server, None, Some("`tcp://192.168.1.20:5000`"))?,
                columns: query.columns()?,
            }
        } else if let Some(at) = body.strip_prefix("udp://") {
            Self::Udp { at: Address::read(at, None, None)?, columns: query.columns()? }
        } else if let Some(rest) = body.strip_prefix("mqtt://") {
            let missing = "the topic is missing; write `mqtt://host/topic`";
            let (broker, topic) = rest.split_once('/').ok_or(missing)?;
            if topic.is_empty() {
                return Err(missing.to_owned());
            }
            let (broker, login) = broker_and_login(broker, topic, query.value("password-file")?)?;
            Self::Mqtt { broker, login, topic: checked_topic(topic)?, columns: query.columns()? }
        } else if let Some(path) = body.strip_prefix("file:") {
            let allowed = "a number from 0, which is as fast as can be, to 1000000";
            let speed = query.take("speed", 1.0, |speed| (0.0..=FASTEST).contains(speed), allowed)?;
            Self::File { path: path.into(), speed }
        } else if let Some(rig) = body.strip_prefix("simulated:") {
            let allowed = "a number greater than 0 and at most 100000 Hz";
            let rate_hz = query.take("rate", 100.0, |rate| *rate > 0.0 && *rate <= 1e5, allowed)?;
            let seed = query.take("seed", 0, |_| true, "a whole number of at least 0")?;
            Self::Simulated { rig: rig.into(), rate_hz, seed }
        } else {
            return Ok(None);
        };
        query.end(&url)?;
        Ok(Some(url))
    }

    fn parameters(&self) -> &'static str {
        match self {
            Self::Stdin => "none",
            Self::File { .. } => "`speed`",
            Self::Serial { .. } => "`baud` and `columns`",
            Self::Tcp { .. } | Self::Udp { .. } => "`columns`",
            Self::Mqtt { .. } => "`columns` and `password-file`",
            Self::Simulated { .. } => "`rate` and `seed`",
        }
    }
}

impl FromStr for SourceUrl {
    type Err = SourceUrlError;

    fn from_str(text: &str) -> Result<Self, SourceUrlError> {
        match Self::parse(text) {
            Ok(Some(url)) => Ok(url),
            Ok(None) => Err(SourceUrlError::Scheme { text: without_passwords(text) }),
            Err(problem) => Err(SourceUrlError::Parameter { text: without_passwords(text), problem }),
        }
    }
}

struct Query<'a>(Vec<&'a str>);

impl<'a> Query<'a> {
    fn take<T: FromStr>(
        &mut self,
        name: &str,
        default: T,
        allows: impl Fn(&T) -> bool,
        allowed: &str,
    ) -> Result<T, String> {
        match self.value(name)? {
            None => Ok(default),
            Some(value) => {
                let problem = || format!("{name} `{value}` must be {allowed}");
                value.parse().ok().filter(allows).ok_or_else(problem)
            }
        }
    }

    fn columns(&mut self) -> Result<Vec<String>, String> {
        let Some(columns) = self.value("columns")? else { return Ok(Vec::new()) };
        let columns: Vec<String> = columns.split(',').map(str::to_owned).collect();
        if columns.iter().any(String::is_empty) {
            let columns = columns.join(",");
            return Err(format!(
                "columns `{columns}` has an empty name; write names separated by commas, as in `a,b,t`"
            ));
        }
        Ok(columns)
    }

    fn value(&mut self, name: &str) -> Result<Option<&'a str>, String> {
        let is = |pair: &&str| pair.split_once('=').is_some_and(|(key, _)| key == name);
        let Some(place) = self.0.iter().position(is) else { return Ok(None) };
        let pair = self.0.remove(place);
        if self.0.iter().any(is) {
            return Err(format!("{name} is given twice; give it once"));
        }
        Ok(pair.split_once('=').map(|(_, value)| value))
    }

    fn end(&self, url: &SourceUrl) -> Result<(), String> {
        let known = url.parameters();
        self.0.first().map_or(Ok(()), |pair| Err(format!("`{pair}` is not a parameter; known are {known}")))
    }
}

/// Checks a filter by section 4.7 of MQTT 3.1.1.
fn checked_topic(topic: &str) -> Result<String, String> {
    let last = topic.split('/').count() - 1;
    for (i, level) in topic.split('/').enumerate() {
        let wild = level.contains(['+', '#']) && level.len() > 1;
        if wild || (level == "#" && i < last) || topic.contains('\0') || topic.len() > 65_535 {
            return Err(format!(
                "topic `{topic}` must have `+` as a whole level, `#` as the last, and at most 65535 bytes"
            ));
        }
    }
    Ok(topic.to_owned())
}

impl fmt::Display for SourceUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = '?';
        match self {
            Self::Stdin => f.write_str("-"),
            Self::File { path, speed } => write!(f, "file:{}?speed={speed}", path.display()),
            Self::Serial { port, baud, .. } => {
                separator = '&';
                write!(f, "serial://{}?baud={baud}", port.display())
            }
            Self::Tcp { server, .. } => write!(f, "tcp://{server}"),
            Self::Udp { at, .. } => write!(f, "udp://{at}"),
            Self::Mqtt { broker, login, topic, .. } => {
                let user = login.as_ref().map_or_else(String::new, |login| format!("{login}@"));
                write!(f, "mqtt://{user}{broker}/{topic}")?;
                if let Some(file) = login.as_ref().and_then(Login::file) {
                    separator = '&';
                    write!(f, "?password-file={file}")?;
                }
                Ok(())
            }
            Self::Simulated { rig, rate_hz, seed } => {
                write!(f, "simulated:{}?rate={rate_hz}&seed={seed}", rig.display())
            }
        }?;
        match self.columns() {
            [] => Ok(()),
            columns => write!(f, "{separator}columns={}", columns.join(",")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn problem(text: &str) -> String {
        text.parse::<SourceUrl>().unwrap_err().to_string()
    }

    #[test]
    fn urls_have_their_defaults() {
        let shown = |text: &str| text.parse::<SourceUrl>().unwrap().to_string();
        for (text, full) in [
            ("-", "-"),
            ("serial:///dev/ttyACM0", "serial:///dev/ttyACM0?baud=115200"),
            ("serial://COM3?columns=a,t&baud=9600", "serial://COM3?baud=9600&columns=a,t"),
            ("tcp://[::1]:5000", "tcp://[::1]:5000"),
            ("udp://:5000?columns=n,a", "udp://:5000?columns=n,a"),
            ("mqtt://broker/lab/+/values", "mqtt://broker:1883/lab/+/values"),
            ("mqtt://me:secret@broker/a", "mqtt://me@broker:1883/a"),
            (
                "mqtt://me@broker/a?password-file=p&columns=a",
                "mqtt://me@broker:1883/a?password-file=p&columns=a",
            ),
            ("simulated:rig.toml", "simulated:rig.toml?rate=100&seed=0"),
        ] {
            assert_eq!(shown(text), full);
        }
    }

    #[test]
    fn an_error_names_the_value_and_what_is_allowed() {
        for (text, words) in [
            ("http://a:1", "sources are `-`"),
            ("serial://", "write `serial:///dev/ttyACM0`"),
            ("serial:///dev/x?baud=0", "baud `0` must be a whole number of 1 to 20000000"),
            ("serial:///dev/x?baud=1&baud=2", "baud is given twice"),
            ("serial:///dev/x?parity=odd", "`parity=odd` is not a parameter; known are `baud` and `columns`"),
            ("tcp://host", "`host` has no port; write `host:5000`"),
            ("tcp://:5000", "the host is missing; write `tcp://"),
            ("tcp://host:70000", "port `70000` must be a whole number of 1 to 65535"),
            ("tcp://a b:1", "host `a b` has ` `"),
            ("tcp://[x]:1", "`x` must be an address of IPv6"),
            ("udp://:5000?columns=a,,b", "columns `a,,b` has an empty name"),
            ("mqtt://host", "write `mqtt://host/topic`"),
            ("mqtt://host/a/#/b", "topic `a/#/b` must have"),
            ("mqtt://:secret@host/a", "the user name before `@` is empty"),
            ("mqtt://me:se/cret@host/a", "write `%2F` for `/`"),
            ("mqtt://host/a?password-file=x", "password-file needs a user name"),
            ("simulated:rig.toml?rate=-1", "rate `-1` must be a number greater than 0"),
        ] {
            assert!(problem(text).contains(words), "{text}: {}", problem(text));
        }
    }

    fn address() -> impl Strategy<Value = Address> {
        let host = prop_oneof![
            "[a-z0-9][a-z0-9.-]{0,20}",
            any::<std::net::Ipv6Addr>().prop_map(|host| host.to_string()),
        ];
        (host, 1..=u16::MAX).prop_map(|(host, port)| Address { host, port })
    }

    fn login() -> impl Strategy<Value = Option<Login>> {
        prop::option::of("[a-z%@:/]{1,8}").prop_map(|user| {
            let encoded: String = user?.bytes().map(|byte| format!("%{byte:02x}")).collect();
            Login::parse(&encoded, None).ok()
        })
    }

    fn url() -> impl Strategy<Value = SourceUrl> {
        let columns = || prop::collection::vec("[^,&?\\pC]{1,8}", 0..4);
        let path = || "[^?&\\pC]{1,20}".prop_map(PathBuf::from);
        let topic = "[^?+#\\pC]{1,20}";
        prop_oneof![
            Just(SourceUrl::Stdin),
            (path(), 1..=GREATEST_BAUD, columns()).prop_map(|(port, baud, columns)| SourceUrl::Serial {
                port,
                baud,
                columns
            }),
            (address(), columns()).prop_map(|(server, columns)| SourceUrl::Tcp { server, columns }),
            (address(), columns()).prop_map(|(at, columns)| SourceUrl::Udp { at, columns }),
            (address(), login(), topic, columns()).prop_map(|(broker, login, topic, columns)| {
                SourceUrl::Mqtt { broker, login, topic, columns }
            }),
            (path(), 1e-3..1e5, any::<u64>()).prop_map(|(rig, rate_hz, seed)| SourceUrl::Simulated {
                rig,
                rate_hz,
                seed
            }),
        ]
    }

    proptest! {
        #[test]
        fn a_url_reads_back_as_it_is_shown(url in url()) {
            prop_assert_eq!(url.to_string().parse::<SourceUrl>(), Ok(url));
        }
    }
}

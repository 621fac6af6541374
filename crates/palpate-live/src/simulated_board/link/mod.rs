#[cfg(unix)]
mod pty;
mod publisher;

use std::fmt;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, ToSocketAddrs, UdpSocket};
use std::path::PathBuf;
use std::str::FromStr;

/// Most waiting bytes, as in the buffer of a board; further frames are lost.
const MOST_WAITING: usize = 1 << 16;
const LONGEST: usize = 1 << 10;

/// URL of a link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkUrl {
    /// `-`: standard output.
    Stdout,
    /// `pty` or `pty:PATH` (link): pseudo-terminal as serial port.
    Pty(Option<PathBuf>),
    /// `tcp://:port`: one client at a time.
    Tcp(String),
    /// `udp://host:port`: one datagram per frame.
    Udp(String),
    /// `mqtt://host/topic`: one message per frame.
    Mqtt(crate::sink::MqttUrl),
}

/// Error of a link URL.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a link of a board; links are `pty`, `pty:PATH`, `tcp://:7000`, `udp://host:7000`, `mqtt://host/topic` and `-`"
)]
pub struct LinkUrlError {
    /// Text.
    pub text: String,
}

/// Error of an opened link.
#[derive(Debug, thiserror::Error)]
#[error("cannot open {url}: {error}")]
pub struct LinkError {
    /// URL.
    pub url: LinkUrl,
    /// Cause.
    pub error: std::io::Error,
}

/// Open link.
pub struct Link {
    transport: Transport,
    name: String,
    pending: Vec<u8>,
    received: Vec<u8>,
    /// Frames lost without a reader, or with a slow one.
    pub unread: u64,
}

enum Transport {
    Stdout(std::io::Stdout),
    #[cfg(unix)]
    Pty(pty::Pty),
    Tcp {
        listener: TcpListener,
        client: Option<TcpStream>,
    },
    Udp {
        socket: UdpSocket,
        to: std::net::SocketAddr,
    },
    Mqtt(publisher::Publisher),
}

impl FromStr for LinkUrl {
    type Err = LinkUrlError;

    fn from_str(text: &str) -> Result<Self, LinkUrlError> {
        let error = || LinkUrlError { text: text.to_owned() };
        let address = |rest: &str, host: &str| {
            let (given, port) = rest.rsplit_once(':').ok_or_else(error)?;
            port.parse::<u16>().map_err(|_| error())?;
            Ok(format!("{}:{port}", if given.is_empty() { host } else { given }))
        };
        match text.split_once(':') {
            None if text == "-" => Ok(Self::Stdout),
            None if text == "pty" => Ok(Self::Pty(None)),
            Some(("pty", path)) if !path.is_empty() => Ok(Self::Pty(Some(path.into()))),
            Some(("tcp", rest)) => {
                Ok(Self::Tcp(address(rest.strip_prefix("//").ok_or_else(error)?, "127.0.0.1")?))
            }
            Some(("udp", rest)) => {
                Ok(Self::Udp(address(rest.strip_prefix("//").ok_or_else(error)?, "127.0.0.1")?))
            }
            Some(("mqtt", _)) => Ok(Self::Mqtt(text.parse().map_err(|_| error())?)),
            _ => Err(error()),
        }
    }
}

impl fmt::Display for LinkUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stdout => f.write_str("-"),
            Self::Pty(None) => f.write_str("pty"),
            Self::Pty(Some(path)) => write!(f, "pty:{}", path.display()),
            Self::Tcp(address) => write!(f, "tcp://{address}"),
            Self::Udp(address) => write!(f, "udp://{address}"),
            Self::Mqtt(url) => url.fmt(f),
        }
    }
}

impl Link {
    /// Opens a link.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(url: &LinkUrl) -> Result<Self, LinkError> {
        let (way, name) = open(url).map_err(|error| LinkError { url: url.clone(), error })?;
        Ok(Self { transport: way, name, pending: Vec::new(), received: Vec::new(), unread: 0 })
    }

    /// Path or address for clients.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Next message of a lost or restored broker.
    pub fn next_message(&self) -> Option<String> {
        match &self.transport {
            Transport::Mqtt(publisher) => publisher.next_message(),
            _ => None,
        }
    }

    /// Sends a frame without waiting for the reader.
    ///
    /// # Errors
    /// A failed link, such as stdout without a reader.
    pub fn send(&mut self, frame: &[u8]) -> std::io::Result<()> {
        match &mut self.transport {
            Transport::Stdout(out) => {
                out.write_all(frame)?;
                return out.flush();
            }
            Transport::Udp { socket, to } => {
                self.unread += u64::from(socket.send_to(frame, *to).is_err());
                return Ok(());
            }
            Transport::Mqtt(publisher) => {
                self.unread += u64::from(!publisher.publish(frame));
                return Ok(());
            }
            Transport::Tcp { listener, client } => {
                accept(listener, client)?;
                if client.is_none() {
                    self.unread += 1;
                    return Ok(());
                }
            }
            #[cfg(unix)]
            Transport::Pty(_) => {}
        }
        if self.pending.len() + frame.len() > MOST_WAITING {
            self.unread += 1;
        } else {
            self.pending.extend_from_slice(frame);
        }
        self.push();
        Ok(())
    }

    fn push(&mut self) {
        while !self.pending.is_empty() {
            let written = match &mut self.transport {
                Transport::Tcp { client: Some(client), .. } => client.write(&self.pending),
                #[cfg(unix)]
                Transport::Pty(pty) => pty.master.write(&self.pending),
                _ => return,
            };
            match written {
                Ok(count) if count > 0 => drop(self.pending.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                _ => return self.drop_client(),
            }
        }
    }

    fn drop_client(&mut self) {
        self.pending.clear();
        self.received.clear();
        if let Transport::Tcp { client, .. } = &mut self.transport {
            *client = None;
        }
    }

    /// Simulates a pulled cable: closes a TCP connection, or replaces a pseudo-terminal.
    ///
    /// # Errors
    /// The system provides no pseudo-terminal.
    pub fn disconnect(&mut self) -> std::io::Result<()> {
        self.drop_client();
        #[cfg(unix)]
        if let Transport::Pty(pty) = &mut self.transport {
            pty.reopen()?;
            self.name = pty.name();
        }
        Ok(())
    }

    /// Received bytes; `None` without a client.
    ///
    /// # Errors
    /// A client that cannot be accepted.
    pub fn bytes(&mut self) -> std::io::Result<Option<Vec<u8>>> {
        if let Transport::Tcp { listener, client } = &mut self.transport {
            accept(listener, client)?;
        }
        self.receive();
        let is_there = !matches!(&self.transport, Transport::Tcp { client: None, .. });
        Ok(is_there.then(|| std::mem::take(&mut self.received)))
    }

    /// Received lines.
    pub fn lines(&mut self) -> Vec<String> {
        self.receive();
        let Some(end) = self.received.iter().rposition(|byte| *byte == b'\n') else { return Vec::new() };
        let lines: Vec<u8> = self.received.drain(..=end).collect();
        String::from_utf8_lossy(&lines).lines().map(str::to_owned).collect()
    }

    fn receive(&mut self) {
        let mut buffer = [0; 512];
        loop {
            let read = match &mut self.transport {
                Transport::Tcp { client: Some(client), .. } => client.read(&mut buffer),
                Transport::Udp { socket, .. } => socket.recv(&mut buffer),
                #[cfg(unix)]
                Transport::Pty(pty) => pty.master.read(&mut buffer),
                _ => break,
            };
            match read {
                Ok(count) if count > 0 && self.received.len() <= LONGEST => {
                    self.received.extend_from_slice(&buffer[..count]);
                }
                Ok(0) => {
                    self.drop_client();
                    break;
                }
                Ok(_) => self.received.clear(),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => break,
            }
        }
    }
}

fn accept(listener: &TcpListener, client: &mut Option<TcpStream>) -> std::io::Result<()> {
    if client.is_none()
        && let Ok((stream, _)) = listener.accept()
    {
        stream.set_nonblocking(true)?;
        let _ = stream.set_nodelay(true);
        *client = Some(stream);
    }
    Ok(())
}

fn open(url: &LinkUrl) -> std::io::Result<(Transport, String)> {
    match url {
        LinkUrl::Stdout => Ok((Transport::Stdout(std::io::stdout()), "stdout".to_owned())),
        #[cfg(unix)]
        LinkUrl::Pty(link) => {
            let pty = pty::Pty::open(link.clone())?;
            let name = pty.name();
            Ok((Transport::Pty(pty), name))
        }
        #[cfg(not(unix))]
        LinkUrl::Pty(_) => Err(std::io::Error::other("pseudo-terminals are not supported here; use tcp")),
        LinkUrl::Tcp(address) => {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            let name = format!("tcp://{}", listener.local_addr()?);
            Ok((Transport::Tcp { listener, client: None }, name))
        }
        LinkUrl::Udp(address) => {
            let to =
                address.to_socket_addrs()?.next().ok_or_else(|| std::io::Error::other("no such host"))?;
            let socket = UdpSocket::bind(if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" })?;
            socket.set_nonblocking(true)?;
            Ok((Transport::Udp { socket, to }, format!("udp://{to}")))
        }
        LinkUrl::Mqtt(url) => Ok((Transport::Mqtt(publisher::Publisher::open(url)?), url.to_string())),
    }
}

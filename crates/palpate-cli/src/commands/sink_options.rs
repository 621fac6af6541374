//! Outputs of `record` and `serve`: ROS 2 and Foxglove.

use crate::failure::{Failure, UserError};
use palpate_live::sink::OpenSink;
use palpate_live::sink::ros::RosUrl;
use std::net::SocketAddr;

/// Options of the outlets.
#[derive(clap::Args)]
pub struct SinkOptions {
    /// Publish contacts and forces to ROS 2 through a Zenoh router: `tcp/host:7447?domain=0&name=palpate&frame=surface`
    #[arg(long, value_name = "ROUTER")]
    ros: Option<RosUrl>,
    /// Serve the session to Foxglove at this address, such as 127.0.0.1:8765
    #[arg(long, value_name = "ADDRESS:PORT")]
    foxglove: Option<SocketAddr>,
}

impl SinkOptions {
    pub fn open(&self) -> Result<Vec<OpenSink>, Failure> {
        let mut sinks = Vec::new();
        if let Some(url) = &self.ros {
            sinks.push(ros(url)?);
        }
        if let Some(address) = self.foxglove {
            sinks.push(foxglove(address)?);
        }
        Ok(sinks)
    }
}

#[cfg(feature = "ros")]
#[expect(clippy::unnecessary_wraps, reason = "a command without ROS refuses")]
fn ros(url: &RosUrl) -> Result<OpenSink, Failure> {
    use palpate_live::sink::ros::RosSink;
    let url = url.clone();
    Ok(Box::new(move |channels, extent, reports| {
        Ok(Box::new(RosSink::new(&url, channels, extent, reports)?))
    }))
}

#[cfg(not(feature = "ros"))]
fn ros(_: &RosUrl) -> Result<OpenSink, Failure> {
    Err(not_built("--ros", "ros"))
}

#[cfg(feature = "foxglove")]
fn foxglove(address: SocketAddr) -> Result<OpenSink, Failure> {
    use crate::remark::remark;
    use palpate_live::sink::foxglove::FoxgloveServer;
    let server = FoxgloveServer::start(address)
        .map_err(|error| UserError::new(error).help("--foxglove 127.0.0.1:0 takes a port that is free"))?;
    let address = server.address();
    remark!("palpate: Foxglove connects to ws://{address}");
    if !address.ip().is_loopback() {
        remark!("warning: everyone who can reach {address} can follow the session: Foxglove has no token");
    }
    Ok(Box::new(move |channels, extent, _| Ok(Box::new(server.sink(channels, extent)?))))
}

#[cfg(not(feature = "foxglove"))]
fn foxglove(_: SocketAddr) -> Result<OpenSink, Failure> {
    Err(not_built("--foxglove", "foxglove"))
}

#[cfg(not(all(feature = "ros", feature = "foxglove")))]
fn not_built(option: &str, feature: &str) -> Failure {
    let user_error =
        UserError::new(format!("{option}: this command was built without its feature `{feature}`"));
    user_error
        .help(format!("build it with: cargo install --path crates/palpate-cli --features {feature}"))
        .into()
}

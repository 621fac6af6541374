use crate::address::Address;
use crate::login::{Login, PASSWORD_VARIABLE};
use rumqttc::{ConnectReturnCode, ConnectionError};

const MQTT_PORT: u16 = 1883;

/// Parses `user:password@host:port`.
pub fn broker_and_login(
    text: &str,
    topic: &str,
    password_file: Option<&str>,
) -> Result<(Address, Option<Login>), String> {
    let example = Some("`mqtt://192.168.1.20/topic`");
    let Some((login, broker)) = text.rsplit_once('@') else {
        if let Some((_, port)) = text.rsplit_once(':')
            && topic.contains('@')
            && port.parse::<u16>().is_err()
        {
            return Err("in user name and password write `%2F` for `/`".to_owned());
        }
        if password_file.is_some() {
            return Err("password-file needs a user name, as in `mqtt://user@host/topic`".to_owned());
        }
        return Ok((Address::read(text, Some(MQTT_PORT), example)?, None));
    };
    let login = Login::parse(login, password_file)?;
    Ok((Address::read(broker, Some(MQTT_PORT), example)?, Some(login)))
}

pub fn explain(broker: &str, error: &ConnectionError) -> String {
    match error {
        ConnectionError::ConnectionRefused(
            code @ (ConnectReturnCode::BadUserNamePassword | ConnectReturnCode::NotAuthorized),
        ) => {
            format!(
                "the broker {broker} refuses: {code:?}; give `mqtt://user@host/topic` and the password in {PASSWORD_VARIABLE}"
            )
        }
        ConnectionError::ConnectionRefused(code) => format!("the broker {broker} refuses: {code:?}"),
        ConnectionError::Io(error) => {
            format!("the broker {broker} cannot be reached: {error}; check that it runs there")
        }
        ConnectionError::NetworkTimeout | ConnectionError::FlushTimeout => {
            format!("the broker {broker} does not answer")
        }
        other => format!("the connection to the broker {broker} broke: {other}"),
    }
}

//! Keys, tokens and attachments of `rmw_zenoh_cpp` (its docs/design.md).

use super::url::RosUrl;

/// Topic of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// `NAME/contact`, `geometry_msgs/msg/PointStamped`.
    Contact,
    /// `NAME/wrench`, `geometry_msgs/msg/WrenchStamped`.
    Wrench,
    /// `NAME/estimate`, `std_msgs/msg/String` with JSON.
    Estimate,
    /// `NAME/event`, `std_msgs/msg/String` with JSON.
    Event,
}

/// All topics in order.
pub const TOPICS: [Topic; 4] = [Topic::Contact, Topic::Wrench, Topic::Estimate, Topic::Event];

/// Default of ROS 2 (reliable, volatile, keep last), depth 10.
const QUALITY: &str = "::,10:,:,:,,";

impl Topic {
    /// Name after that of the session.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Wrench => "wrench",
            Self::Estimate => "estimate",
            Self::Event => "event",
        }
    }

    /// Type of the messages.
    pub const fn message_type(self) -> &'static str {
        match self {
            Self::Contact => "geometry_msgs/msg/PointStamped",
            Self::Wrench => "geometry_msgs/msg/WrenchStamped",
            Self::Estimate | Self::Event => "std_msgs/msg/String",
        }
    }

    /// Hash of the type (REP 2016); nodes with another hash receive no messages.
    pub const fn type_hash(self) -> &'static str {
        match self {
            Self::Contact => "RIHS01_4c0296af86e01e562e9e0405d138a01537247580076c58ea38d7923ac1045897",
            Self::Wrench => "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
            Self::Estimate | Self::Event => {
                "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
            }
        }
    }

    /// `geometry_msgs::msg::dds_::PointStamped_/RIHS01_…`.
    fn type_in_key(self) -> String {
        let (package, name) = self.message_type().rsplit_once('/').unwrap_or_default();
        format!("{}::dds_::{name}_/{}", package.replace('/', "::"), self.type_hash())
    }
}

/// Keys of a node and its publishers.
#[derive(Clone, Debug)]
pub struct Keys<'a> {
    /// Domain, names and frame.
    pub url: &'a RosUrl,
    /// Identity of the Zenoh session as text and little-endian bytes.
    pub session: (String, [u8; 16]),
}

impl Keys<'_> {
    /// Key of a topic.
    pub fn data(&self, topic: Topic) -> String {
        let RosUrl { domain, name, .. } = self.url;
        format!("{domain}/{name}/{}/{}", topic.name(), topic.type_in_key())
    }

    /// Token of the node.
    pub fn node_token(&self) -> String {
        self.token("0/0/NN")
    }

    /// Token of a publisher.
    pub fn publisher_token(&self, topic: Topic) -> String {
        let topic_name = format!("%{}%{}", self.url.name.replace('/', "%"), topic.name());
        let token = self.token(&format!("0/{}/MP", entity(topic)));
        format!("{token}/{topic_name}/{}/{QUALITY}", topic.type_in_key())
    }

    /// Attachment of a message: number from 1, time, and identity of the publisher.
    pub fn attachment(&self, topic: Topic, number: i64, unix_ns: u64) -> [u8; 33] {
        let mut publisher = self.session.1;
        // The identities of a session's publishers differ in this byte, which a shorter identity uses last.
        publisher[15] ^= entity(topic);
        let mut bytes = [0; 33];
        bytes[..8].copy_from_slice(&number.to_le_bytes());
        bytes[8..16].copy_from_slice(&i64::try_from(unix_ns).unwrap_or(i64::MAX).to_le_bytes());
        bytes[16] = publisher.len() as u8;
        bytes[17..].copy_from_slice(&publisher);
        bytes
    }

    /// `@ros2_lv/DOMAIN/SESSION/NODE/ENTITY/KIND/ENCLAVE/NAMESPACE/NODE NAME`, with `%` for `/` within a
    /// part.
    fn token(&self, entity: &str) -> String {
        let RosUrl { domain, name, .. } = self.url;
        let (namespace, node) = name.rsplit_once('/').unwrap_or(("", name));
        format!("@ros2_lv/{domain}/{}/{entity}/%/%{}/{node}", self.session.0, namespace.replace('/', "%"))
    }
}

/// The node has 0.
const fn entity(topic: Topic) -> u8 {
    topic as u8 + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    const HASH: &str = "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77";

    #[test]
    fn keys_and_tokens_are_those_of_rmw_zenoh() {
        let url: RosUrl = "tcp/robot:7447?domain=7&name=bench/left".parse().unwrap();
        let keys = Keys { url: &url, session: ("ab12".to_owned(), [0; 16]) };
        let wrench = format!("geometry_msgs::msg::dds_::WrenchStamped_/{HASH}");
        assert_eq!(keys.data(Topic::Wrench), format!("7/bench/left/wrench/{wrench}"));
        assert_eq!(keys.node_token(), "@ros2_lv/7/ab12/0/0/NN/%/%bench/left");
        assert_eq!(
            keys.publisher_token(Topic::Wrench),
            format!("@ros2_lv/7/ab12/0/2/MP/%/%bench/left/%bench%left%wrench/{wrench}/::,10:,:,:,,")
        );
    }

    #[test]
    fn without_a_namespace_its_place_is_kept() {
        let url: RosUrl = "tcp/robot".parse().unwrap();
        let keys = Keys { url: &url, session: ("ab12".to_owned(), [0; 16]) };
        assert_eq!(keys.node_token(), "@ros2_lv/0/ab12/0/0/NN/%/%/palpate");
        assert!(keys.publisher_token(Topic::Contact).contains("/MP/%/%/palpate/%palpate%contact/"));
    }

    #[test]
    fn attachments_number_messages_and_tell_publishers_apart() {
        let url: RosUrl = "tcp/robot".parse().unwrap();
        let keys = Keys { url: &url, session: (String::new(), *b"0123456789abcdef") };
        let bytes = keys.attachment(Topic::Wrench, 258, 1_800_000_000_000_000_001);
        assert_eq!(bytes[..8], [2, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(i64::from_le_bytes(bytes[8..16].try_into().unwrap()), 1_800_000_000_000_000_001);
        assert_eq!((bytes[16], &bytes[17..32]), (16, &b"0123456789abcde"[..]));
        let mut last = TOPICS.map(|topic| keys.attachment(topic, 1, 0)[32]).to_vec();
        last.dedup();
        assert_eq!(last.len(), TOPICS.len());
    }
}

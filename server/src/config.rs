//! How the coordinator is set up.

use std::net::SocketAddr;
use std::time::Duration;

use sha2::{Digest, Sha256};

/// Set-up of the coordinator.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// Where to listen. Port 0 takes a free one.
    pub listen: SocketAddr,
    /// Needed for every address that is not loopback.
    pub token: Option<Token>,
    /// Length of a lease; workers renew it every third of it.
    pub lease: Duration,
    /// Claims of an evaluation before it ends as `lost`.
    pub attempts: i64,
    /// Its workers are children that end with it: leases found at the start are void, and nobody waits for their end.
    pub workers_end_with_it: bool,
    /// Takes studies whose models are programs; they run on workers that allow it.
    pub allow_commands: bool,
    /// Largest body of a request, bytes.
    pub body_limit: usize,
}

impl ServerConfig {
    /// Leases of 15 s, 5 attempts, no programs, bodies up to 4 MiB.
    ///
    /// # Errors
    /// [`ConfigError::TokenNeeded`] for an address other than loopback without a token.
    pub fn new(listen: SocketAddr, token: Option<Token>) -> Result<Self, ConfigError> {
        if token.is_none() && !listen.ip().is_loopback() {
            return Err(ConfigError::TokenNeeded { listen });
        }
        Ok(Self {
            listen,
            token,
            lease: Duration::from_secs(15),
            attempts: 5,
            workers_end_with_it: false,
            allow_commands: false,
            body_limit: 4 << 20,
        })
    }
}

/// A set-up that is refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// Listening to the world without a token.
    #[error("{listen} is not a loopback address: a token is needed")]
    TokenNeeded {
        /// The address.
        listen: SocketAddr,
    },
    /// A token that can be guessed.
    #[error("the token has {found} characters, {expected} are the least")]
    TokenTooShort {
        /// Least number of characters.
        expected: usize,
        /// Found.
        found: usize,
    },
    /// The system gives no random numbers.
    #[error("no random numbers: {0}")]
    NoRandomness(String),
}

/// A bearer token, kept as its hash.
#[derive(Clone)]
pub struct Token {
    sha256: [u8; 32],
}

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// Least number of characters: 128 random bits in hexadecimal.
    pub const LEAST_LENGTH: usize = 32;

    /// Takes a token that was made elsewhere.
    ///
    /// # Errors
    /// [`ConfigError::TokenTooShort`].
    pub fn new(text: &str) -> Result<Self, ConfigError> {
        let text = text.trim();
        if text.len() < Self::LEAST_LENGTH {
            return Err(ConfigError::TokenTooShort {
                expected: Self::LEAST_LENGTH,
                found: text.len(),
            });
        }
        Ok(Self {
            sha256: Sha256::digest(text.as_bytes()).into(),
        })
    }

    /// Makes a token of 256 random bits; the text is to be shown once.
    ///
    /// # Errors
    /// [`ConfigError::NoRandomness`].
    pub fn random() -> Result<(Self, String), ConfigError> {
        let text = random_hex(32)?;
        Ok((Self::new(&text)?, text))
    }

    /// Compares in constant time: the hashes, so that not even the length shows.
    pub fn matches(&self, offered: &str) -> bool {
        let offered: [u8; 32] = Sha256::digest(offered.trim().as_bytes()).into();
        let difference = self
            .sha256
            .iter()
            .zip(offered)
            .fold(0_u8, |sum, (a, b)| sum | (a ^ b));
        std::hint::black_box(difference) == 0
    }
}

/// Random bytes in hexadecimal.
///
/// # Errors
/// [`ConfigError::NoRandomness`].
pub fn random_hex(bytes: usize) -> Result<String, ConfigError> {
    let mut buffer = vec![0_u8; bytes];
    getrandom::fill(&mut buffer).map_err(|e| ConfigError::NoRandomness(e.to_string()))?;
    Ok(hex(&buffer))
}

/// Bytes in hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_addresses_than_loopback_need_a_token() {
        let any = "0.0.0.0:0".parse().unwrap();
        assert!(ServerConfig::new(any, None).is_err());
        let (token, text) = Token::random().unwrap();
        assert_eq!(text.len(), 64);
        assert!(token.matches(&text) && !token.matches("guess"));
        assert!(ServerConfig::new(any, Some(token)).is_ok());
        assert!(ServerConfig::new("[::1]:0".parse().unwrap(), None).is_ok());
        assert!(Token::new("short").is_err());
    }
}

//! Where a store is.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr as _;

use sqlx::postgres::PgConnectOptions;

/// A file, or a server's database.
#[derive(Clone)]
pub enum Address {
    /// An SQLite file, which one process has to itself.
    File(PathBuf),
    /// A PostgreSQL database.
    Server(Box<PgConnectOptions>),
}

/// An address that leads nowhere.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Command lines and logs are read by others.
    #[error("an address holds no password: give it in a file, or in a variable of its own")]
    HoldsPassword,
    /// SQLite would take it for a database that ends with the process, or for an address of its own.
    #[error("{0:?} is no path of a file")]
    NoFile(String),
    /// As the reader of addresses says.
    #[error("no address of a PostgreSQL database: {0}")]
    Unreadable(String),
}

impl Address {
    /// The address that a text means: `postgres://…`, or the path of a file.
    ///
    /// # Errors
    /// Where it holds a password, which whoever lists processes could read, or is none, as the empty text is none.
    pub fn new(text: &str, password: Option<&str>) -> Result<Self, AddressError> {
        let Some(rest) = text.strip_prefix("postgres://").or_else(|| text.strip_prefix("postgresql://")) else {
            let is_path = !text.is_empty() && text != ":memory:" && !text.starts_with("file:");
            return if is_path { Ok(Self::File(text.into())) } else { Err(AddressError::NoFile(text.into())) };
        };
        let (place, query) = rest.split_once('?').unwrap_or((rest, ""));
        let user = place.split('/').next().and_then(|authority| authority.rsplit_once('@')).map(|(user, _)| user);
        let is_password = |parameter: &str| parameter.split('=').next() == Some("password");
        if user.is_some_and(|user| user.contains(':')) || query.split('&').any(is_password) {
            return Err(AddressError::HoldsPassword);
        }
        let options = PgConnectOptions::from_str(text).map_err(|error| AddressError::Unreadable(error.to_string()))?;
        Ok(Self::Server(Box::new(match password {
            Some(password) => options.password(password),
            None => options,
        })))
    }

    /// Whether several processes may use it at once.
    pub const fn is_shared(&self) -> bool {
        matches!(self, Self::Server(_))
    }
}

/// Without the password.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Server(options) => {
                let database = options.get_database().unwrap_or(options.get_username());
                write!(f, "postgres://{}:{}/{database}", options.get_host(), options.get_port())
            }
        }
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

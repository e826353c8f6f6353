//! A TCP stream whose every wait ends at one instant, so that a peer that sends byte by byte holds nobody up.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::Service;

/// Longest wait for one address to answer, and for the peer to take what is sent.
const CONNECT_LIMIT: Duration = Duration::from_millis(500);

/// One connection.
#[derive(Debug)]
pub(super) struct Line {
    stream: TcpStream,
    until: Instant,
}

impl Line {
    /// Connects to the first address of the host that answers.
    pub(super) fn open(service: &Service, until: Instant) -> io::Result<Self> {
        let mut last = io::Error::new(ErrorKind::NotFound, "the name has no address");
        for address in (service.host.as_str(), service.port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT_LIMIT) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    stream.set_write_timeout(Some(CONNECT_LIMIT))?;
                    return Ok(Self { stream, until });
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    /// Waits end then.
    pub(super) fn wait_until(&mut self, until: Instant) {
        self.until = until;
    }
}

impl Read for Line {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::WouldBlock.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(into)
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

//! The connection to Chromium: calls and their answers, and what is reported meanwhile.

use super::log::Log;
use anyhow::{Context, Result, anyhow, bail};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

/// How long is listened at once: limits of time are kept as exactly.
const SLICE: Duration = Duration::from_millis(20);

/// To a browser, for all of its tabs.
pub struct Connection {
    socket: WebSocket<TcpStream>,
    calls: u64,
    /// What each session reported.
    pub logs: BTreeMap<String, Log>,
}

impl Connection {
    /// To where a browser listens.
    pub fn open(address: &str) -> Result<Self> {
        let host = address.trim_start_matches("ws://").split('/').next().unwrap_or_default();
        let stream = TcpStream::connect(host).with_context(|| format!("there is nobody at {address}"))?;
        stream.set_nodelay(true)?;
        // Pictures may be large.
        let config = WebSocketConfig::default().max_message_size(None).max_frame_size(None);
        let (socket, _) = tungstenite::client::client_with_config(address, stream, Some(config))
            .map_err(|error| anyhow!("Chromium does not talk at {address}: {error}"))?;
        socket.get_ref().set_read_timeout(Some(SLICE))?;
        Ok(Self { socket, calls: 0, logs: BTreeMap::new() })
    }

    /// What a method returns.
    pub fn call(
        &mut self,
        session: Option<&str>,
        method: &str,
        arguments: &Value,
        limit: Duration,
    ) -> Result<Value> {
        self.calls += 1;
        let call = self.calls;
        let mut message = json!({ "id": call, "method": method, "params": arguments });
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        self.socket.send(Message::text(message.to_string())).context("the connection to Chromium broke")?;
        let start = Instant::now();
        while start.elapsed() < limit {
            let answer = self.receive()?;
            if answer["id"] == call {
                return result(answer);
            }
            if session.and_then(|session| self.logs.get(session)).is_some_and(|log| log.crashed) {
                bail!("the tab crashed");
            }
        }
        bail!("there was no answer within {:.1} s", limit.as_secs_f64());
    }

    /// Takes what is reported within a time, and all that has been.
    pub fn listen(&mut self, time: Duration) -> Result<()> {
        let start = Instant::now();
        loop {
            let message = self.receive()?;
            if message.is_null() && start.elapsed() >= time {
                return Ok(());
            }
        }
    }

    /// The next message, or null if there was none for a while; what it reports is written down.
    fn receive(&mut self) -> Result<Value> {
        let text = match self.socket.read() {
            Ok(Message::Text(text)) => text,
            Ok(_) => return Ok(Value::Null),
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(Value::Null);
            }
            Err(error) => return Err(error).context("the connection to Chromium broke"),
        };
        let message: Value = serde_json::from_str(&text).context("Chromium sent what is no JSON")?;
        if let (Some(session), Some(method)) = (message["sessionId"].as_str(), message["method"].as_str()) {
            self.logs.entry(session.into()).or_default().add(method, &message["params"]);
        }
        Ok(message)
    }
}

fn result(mut answer: Value) -> Result<Value> {
    match answer["error"].take() {
        Value::Null => Ok(answer["result"].take()),
        error => bail!("{}", error["message"].as_str().unwrap_or("it failed")),
    }
}

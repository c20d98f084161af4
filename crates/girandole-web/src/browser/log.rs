//! What a tab reports: its console, and what of that is trouble.

use serde_json::Value;

/// What Chromium says where there is no adapter. That is no trouble: pages are told, and asked what they make of it.
const NO_ADAPTER: &str = "Failed to create WebGPU Context Provider";

/// Of a tab.
#[derive(Debug, Default)]
pub struct Log {
    /// Everything, a message an element.
    pub console: Vec<String>,
    /// What counts as trouble: exceptions, warnings and errors.
    pub troubles: Vec<String>,
    /// How often a page has been loaded.
    pub loads: u32,
    /// Whether its process ended.
    pub crashed: bool,
}

impl Log {
    /// Writes an event of the protocol down.
    pub fn add(&mut self, method: &str, event: &Value) {
        match method {
            "Runtime.exceptionThrown" => self.trouble(&exception(&event["exceptionDetails"])),
            "Runtime.consoleAPICalled" => self.console_call(event),
            "Log.entryAdded" => self.entry(&event["entry"]),
            "Inspector.targetCrashed" => {
                self.crashed = true;
                self.trouble("the tab crashed");
            }
            "Page.loadEventFired" => self.loads += 1,
            _ => {}
        }
    }

    fn console_call(&mut self, event: &Value) {
        let kind = event["type"].as_str().unwrap_or_default();
        let words: Vec<String> = event["args"].as_array().into_iter().flatten().map(value).collect();
        let text = words.join(" ");
        self.message(kind, &text, matches!(kind, "error" | "warning" | "assert"));
    }

    fn entry(&mut self, entry: &Value) {
        let level = entry["level"].as_str().unwrap_or_default();
        let text = entry["text"].as_str().unwrap_or_default();
        let is_trouble = matches!(level, "error" | "warning") && text != NO_ADAPTER;
        let text = match entry["url"].as_str() {
            Some(url) if !url.is_empty() => format!("{text} ({url})"),
            _ => text.to_string(),
        };
        self.message(level, &text, is_trouble);
    }

    fn message(&mut self, kind: &str, text: &str, trouble: bool) {
        let text = format!("{kind}: {text}");
        if trouble {
            self.trouble(&text);
        } else {
            self.console.push(text);
        }
    }

    fn trouble(&mut self, text: &str) {
        self.console.push(text.to_string());
        self.troubles.push(text.to_string());
    }
}

/// An exception in words.
pub fn exception(details: &Value) -> String {
    let place = match (details["url"].as_str(), details["lineNumber"].as_u64()) {
        (Some(url), Some(line)) if !url.is_empty() => format!(" ({url}:{})", line + 1),
        _ => String::new(),
    };
    let text = details["text"].as_str().unwrap_or("exception");
    match &details["exception"] {
        Value::Null => format!("{text}{place}"),
        exception => format!("{text} {}{place}", value(exception)),
    }
}

/// A value of JavaScript in words.
fn value(object: &Value) -> String {
    match (&object["value"], object["description"].as_str(), object["unserializableValue"].as_str()) {
        (Value::String(text), _, _) => text.clone(),
        (Value::Null, Some(text), _) | (Value::Null, None, Some(text)) => text.to_string(),
        (Value::Null, None, None) => object["subtype"].as_str().unwrap_or("undefined").to_string(),
        (value, _, _) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn console(kind: &str, arguments: &Value) -> Value {
        json!({ "type": kind, "args": arguments })
    }

    #[test]
    fn errors_and_warnings_are_trouble_and_other_messages_are_not() {
        let mut log = Log::default();
        log.add(
            "Runtime.consoleAPICalled",
            &console("log", &json!([{ "type": "string", "value": "hello" }])),
        );
        log.add("Log.entryAdded", &json!({ "entry": { "level": "info", "text": "news" } }));
        log.add(
            "Log.entryAdded",
            &json!({ "entry": { "level": "warning", "text": NO_ADAPTER, "url": "http://a/b" } }),
        );
        assert!(log.troubles.is_empty());
        log.add("Runtime.consoleAPICalled", &console("warning", &json!([{ "value": 1 }, { "value": "b" }])));
        log.add("Runtime.consoleAPICalled", &console("error", &json!([{ "description": "Error: bad" }])));
        log.add("Runtime.consoleAPICalled", &console("assert", &json!([{ "value": true }])));
        log.add(
            "Log.entryAdded",
            &json!({ "entry": { "level": "error", "text": "404", "url": "http://a/b" } }),
        );
        log.add("Log.entryAdded", &json!({ "entry": { "level": "warning", "text": "old" } }));
        let troubles =
            ["warning: 1 b", "error: Error: bad", "assert: true", "error: 404 (http://a/b)", "warning: old"];
        assert_eq!(log.troubles, troubles);
        assert_eq!(log.console.len(), 8);
        assert_eq!(log.console[..2], ["log: hello", "info: news"]);
    }

    #[test]
    fn exceptions_and_crashes_are_trouble() {
        let mut log = Log::default();
        let details = json!({ "text": "Uncaught", "url": "http://a/b.js", "lineNumber": 4,
            "exception": { "description": "Error: no\n  at f" } });
        log.add("Runtime.exceptionThrown", &json!({ "exceptionDetails": details }));
        log.add("Inspector.targetCrashed", &json!({}));
        assert_eq!(log.troubles, ["Uncaught Error: no\n  at f (http://a/b.js:5)", "the tab crashed"]);
        assert!(log.crashed);
    }

    #[test]
    fn values_are_said_as_a_console_would() {
        assert_eq!(value(&json!({ "type": "undefined" })), "undefined");
        assert_eq!(value(&json!({ "type": "object", "subtype": "null", "value": null })), "null");
        assert_eq!(value(&json!({ "type": "number", "unserializableValue": "NaN" })), "NaN");
        assert_eq!(value(&json!({ "type": "object", "description": "Array(3)" })), "Array(3)");
    }
}

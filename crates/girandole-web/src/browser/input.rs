//! What hands do to a page: mouse, keys, fingers, and files that are dropped.

use super::tab::{Tab, paths};
use anyhow::Result;
use serde_json::{Value, json};
use std::path::Path;

/// A mouse button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The left one.
    Left,
    /// The middle one.
    Middle,
    /// The right one.
    Right,
}

impl Button {
    fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Middle => "middle",
            Self::Right => "right",
        }
    }

    fn bit(self) -> u32 {
        match self {
            Self::Left => 1,
            Self::Right => 2,
            Self::Middle => 4,
        }
    }
}

/// A key of a keyboard as in the United States.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// One that writes: a small letter, a digit, or a space.
    Character(char),
    /// One that does not, as JavaScript names it: `Enter`, `Escape`, `ArrowLeft`, `Shift`, `F1`, …
    Named(&'static str),
}

impl Key {
    /// What an event says of it: its name, its place, its text, and its number.
    fn describe(self) -> (String, String, String, u32) {
        match self {
            Self::Character(c) => {
                let upper = c.to_ascii_uppercase();
                let code = match c {
                    ' ' => "Space".into(),
                    '0'..='9' => format!("Digit{c}"),
                    _ => format!("Key{upper}"),
                };
                (c.into(), code, c.into(), upper.into())
            }
            Self::Named(name) => {
                let code = match name {
                    "Shift" | "Control" | "Alt" | "Meta" => format!("{name}Left"),
                    _ => name.into(),
                };
                (name.into(), code, if name == "Enter" { "\r" } else { "" }.into(), number(name))
            }
        }
    }

    /// The bit by which other events say that it is down.
    fn modifier(self) -> u32 {
        match self {
            Self::Named("Alt") => 1,
            Self::Named("Control") => 2,
            Self::Named("Meta") => 4,
            Self::Named("Shift") => 8,
            _ => 0,
        }
    }
}

/// Windows' number of a key.
fn number(name: &str) -> u32 {
    match name {
        "Backspace" => 8,
        "Tab" => 9,
        "Enter" => 13,
        "Shift" => 16,
        "Control" => 17,
        "Alt" => 18,
        "Escape" => 27,
        "PageUp" => 33,
        "PageDown" => 34,
        "End" => 35,
        "Home" => 36,
        "ArrowLeft" => 37,
        "ArrowUp" => 38,
        "ArrowRight" => 39,
        "ArrowDown" => 40,
        "Delete" => 46,
        "Meta" => 91,
        _ => match name.strip_prefix('F').and_then(|number| number.parse::<u32>().ok()) {
            Some(number @ 1..=12) => 111 + number,
            _ => 0,
        },
    }
}

/// Places are in pixels of the page, from its upper left corner.
impl Tab<'_> {
    /// Moves the mouse there.
    pub fn mouse_move(&self, place: [f64; 2]) -> Result<()> {
        self.mouse("mouseMoved", place, None)
    }

    /// Presses a mouse button there.
    pub fn mouse_press(&self, place: [f64; 2], button: Button) -> Result<()> {
        self.buttons.set(self.buttons.get() | button.bit());
        self.mouse("mousePressed", place, Some(button))
    }

    /// Releases it there.
    pub fn mouse_release(&self, place: [f64; 2], button: Button) -> Result<()> {
        self.buttons.set(self.buttons.get() & !button.bit());
        self.mouse("mouseReleased", place, Some(button))
    }

    /// Moves the mouse there, and presses and releases the left button.
    pub fn click(&self, place: [f64; 2]) -> Result<()> {
        self.mouse_move(place)?;
        self.mouse_press(place, Button::Left)?;
        self.mouse_release(place, Button::Left)
    }

    /// Turns the mouse wheel there by so many pixels to the right and downwards.
    pub fn wheel(&self, [x, y]: [f64; 2], [right, down]: [f64; 2]) -> Result<()> {
        let event = json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": right, "deltaY": down,
            "modifiers": self.modifiers.get(), "buttons": self.buttons.get() });
        self.dispatch("Mouse", event)
    }

    fn mouse(&self, kind: &str, [x, y]: [f64; 2], button: Option<Button>) -> Result<()> {
        let event = json!({ "type": kind, "x": x, "y": y, "button": button.map_or("none", Button::name),
            "buttons": self.buttons.get(), "modifiers": self.modifiers.get(),
            "clickCount": u32::from(button.is_some()) });
        self.dispatch("Mouse", event)
    }

    /// Presses a key, which stays down.
    pub fn key_down(&self, key: Key) -> Result<()> {
        self.modifiers.set(self.modifiers.get() | key.modifier());
        let (name, code, text, number) = key.describe();
        // With Control or Alt, a key writes nothing.
        let text = if self.modifiers.get() & 7 == 0 { text } else { String::new() };
        let kind = if text.is_empty() { "rawKeyDown" } else { "keyDown" };
        let event = json!({ "type": kind, "key": name, "code": code, "text": text,
            "windowsVirtualKeyCode": number, "modifiers": self.modifiers.get() });
        self.dispatch("Key", event)
    }

    /// Releases it.
    pub fn key_up(&self, key: Key) -> Result<()> {
        self.modifiers.set(self.modifiers.get() & !key.modifier());
        let (name, code, _, number) = key.describe();
        let event = json!({ "type": "keyUp", "key": name, "code": code, "windowsVirtualKeyCode": number,
            "modifiers": self.modifiers.get() });
        self.dispatch("Key", event)
    }

    /// Presses and releases a key.
    pub fn press(&self, key: Key) -> Result<()> {
        self.key_down(key)?;
        self.key_up(key)
    }

    /// Puts fingers down: all that are then on the screen.
    pub fn touch_start(&self, fingers: &[[f64; 2]]) -> Result<()> {
        self.touch("touchStart", fingers)
    }

    /// Moves the fingers that are down there, in the same order.
    pub fn touch_move(&self, fingers: &[[f64; 2]]) -> Result<()> {
        self.touch("touchMove", fingers)
    }

    /// Lifts all fingers.
    pub fn touch_end(&self) -> Result<()> {
        self.touch("touchEnd", &[])
    }

    fn touch(&self, kind: &str, fingers: &[[f64; 2]]) -> Result<()> {
        let points = fingers.iter().enumerate().map(|(id, [x, y])| json!({ "x": x, "y": y, "id": id }));
        self.dispatch("Touch", json!({ "type": kind, "touchPoints": points.collect::<Vec<_>>() }))
    }

    /// Drags files there and drops them.
    pub fn drop_files(&self, [x, y]: [f64; 2], files: &[&Path]) -> Result<()> {
        // The bit allows to copy them.
        let data = json!({ "items": [], "files": paths(files)?, "dragOperationsMask": 1 });
        for kind in ["dragEnter", "dragOver", "drop"] {
            self.dispatch("Drag", json!({ "type": kind, "x": x, "y": y, "data": data }))?;
        }
        Ok(())
    }

    fn dispatch(&self, device: &str, event: Value) -> Result<()> {
        self.call(&format!("Input.dispatch{device}Event"), event)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_described_as_chromium_does() {
        let described = |key: Key| {
            let (name, code, text, number) = key.describe();
            format!("{name}|{code}|{text}|{number}")
        };
        assert_eq!(described(Key::Character('w')), "w|KeyW|w|87");
        assert_eq!(described(Key::Character('7')), "7|Digit7|7|55");
        assert_eq!(described(Key::Character(' ')), " |Space| |32");
        assert_eq!(described(Key::Named("ArrowLeft")), "ArrowLeft|ArrowLeft||37");
        assert_eq!(described(Key::Named("Enter")), "Enter|Enter|\r|13");
        assert_eq!(described(Key::Named("F3")), "F3|F3||114");
        assert_eq!(described(Key::Named("Shift")), "Shift|ShiftLeft||16");
        assert_eq!(Key::Named("Shift").modifier(), 8);
    }
}

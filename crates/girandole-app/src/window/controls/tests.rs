use super::super::session::tests::{SIZE, session};
use super::*;
use egui::{Context, RawInput, Sense};

/// A key that goes down or up.
fn key(key: Key, pressed: bool, modifiers: Modifiers) -> Event {
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
}

/// The picture without a panel, and what hands do to it.
struct Hands {
    context: Context,
    session: Session,
    tools: Tools,
}

impl Hands {
    fn new() -> Self {
        let tools = Tools::new("shot.png".into(), SIZE, None);
        Self { context: Context::default(), session: session(), tools }
    }

    /// A frame of 50 ms, at the end of which these modifiers are held. Returns whether the view is another one after it.
    fn frame(&mut self, mut events: Vec<Event>, modifiers: Modifiers) -> bool {
        events.push(Event::ModifiersChanged(modifiers));
        let before = self.session.view(SIZE);
        let input = RawInput { events, predicted_dt: 0.05, ..RawInput::default() };
        let Self { context, session, tools } = self;
        let mut output = context.run_ui(input, |ui| {
            let response = ui.allocate_response(ui.available_size(), Sense::click_and_drag());
            act(ui, &response, session, tools);
        });
        output.textures_delta.clear();
        session.view(SIZE) != before
    }
}

#[test]
fn one_walks_as_long_as_a_key_is_down() {
    let mut hands = Hands::new();
    let (none, fast) = (Modifiers::NONE, Modifiers::SHIFT);
    assert!(!hands.frame(vec![], none));
    assert!(hands.frame(vec![key(Key::W, true, none)], none));
    assert!(hands.frame(vec![], none) && hands.frame(vec![], fast));
    // Two that lead to opposite sides.
    assert!(!hands.frame(vec![key(Key::S, true, fast)], fast));
    assert!(hands.frame(vec![key(Key::W, false, none)], none));
    assert!(!hands.frame(vec![key(Key::S, false, none)], none));
}

#[test]
fn a_shortcut_leads_nowhere_whichever_of_its_keys_is_let_go_first() {
    for letter in [Key::Q, Key::W, Key::A, Key::D] {
        let mut hands = Hands::new();
        assert!(!hands.frame(vec![key(letter, true, Modifiers::COMMAND)], Modifiers::NONE));
        assert!(!hands.frame(vec![], Modifiers::NONE));
        assert!(!hands.frame(vec![key(letter, false, Modifiers::NONE)], Modifiers::NONE));
        assert_eq!(hands.tools.quits, letter == Key::Q);
        // The control: by itself it leads somewhere.
        assert!(hands.frame(vec![key(letter, true, Modifiers::NONE)], Modifiers::NONE));
    }
}

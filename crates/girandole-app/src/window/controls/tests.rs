use super::super::session::tests::{SIZE, session};
use super::*;
use egui::{Context, Event, Key, Modifiers, RawInput, Sense, pos2};
use girandole_core::scene::LightId;

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

#[test]
fn several_keys_of_a_slow_frame_all_count_and_in_their_order() {
    let mut hands = Hands::new();
    let (none, shift, command) = (Modifiers::NONE, Modifiers::SHIFT, Modifiers::COMMAND);
    // egui takes a key that goes down again without having been let go for a repetition.
    let press = |keys: &[(Key, Modifiers)]| -> Vec<Event> {
        keys.iter().flat_map(|(name, held)| [true, false].map(|is_down| key(*name, is_down, *held))).collect()
    };
    let lamps = |hands: &Hands| hands.session.scene.lights.iter().map(|light| light.name.clone()).collect();
    let (undo, redo) = ((Key::Z, command), (Key::Y, command));
    hands.frame(press(&[(Key::L, none), (Key::L, shift), undo, undo, redo]), none);
    let now: Vec<String> = lamps(&hands);
    assert_eq!(now, ["point lamp"]);
    hands.frame(press(&[redo, (Key::Delete, none), (Key::Delete, none)]), none);
    assert_eq!(hands.session.scene.lights.len(), 2);
    assert!(!hands.session.scene.is_light_removed(LightId(1)), "nothing is picked once it was gone");
    // A panel is there, switched off, copied and taken away; then Ctrl Z brings all of it back, step by step.
    hands.frame(press(&[(Key::P, none), (Key::O, none), (Key::D, command)]), none);
    let scene = &hands.session.scene;
    let panels = scene.objects.iter().filter(|object| object.name.starts_with("panel")).count();
    assert_eq!((panels, scene.materials.last().unwrap().emission), (2, Vec3::ZERO));
    hands.frame(press(&[undo; 2]), none);
    let scene = &hands.session.scene;
    assert!(scene.materials.last().unwrap().emission.x > 0.0);
    assert_eq!(scene.objects.last().unwrap().name, "panel");
    hands.frame(press(&[undo; 9]), none);
    assert!(hands.session.edits.0.is_empty() && hands.session.scene.lights.is_empty());
    // Ctrl L loads edits.
    hands.frame(press(&[(Key::L, command)]), none);
    assert!(hands.session.edits.0.is_empty());
}

#[test]
fn what_is_typed_into_a_dialog_does_nothing_else() {
    let mut hands = Hands::new();
    hands.tools.has_dialog = true;
    assert!(!hands.frame(vec![key(Key::W, true, Modifiers::NONE)], Modifiers::NONE));
    hands.frame(vec![key(Key::Q, true, Modifiers::COMMAND)], Modifiers::NONE);
    assert!(!hands.tools.quits);
    let released = [Key::W, Key::Q].map(|letter| key(letter, false, Modifiers::NONE));
    hands.frame(released.into(), Modifiers::NONE);
    // The control: without it they act.
    hands.tools.has_dialog = false;
    hands.frame(vec![key(Key::Q, true, Modifiers::COMMAND)], Modifiers::NONE);
    assert!(hands.tools.quits);
}

#[test]
fn escape_gives_a_drag_up() {
    let none = Modifiers::NONE;
    let to = |x: f32| Event::PointerMoved(pos2(x, 100.0));
    let button = |x: f32, pressed: bool| {
        let pos = pos2(x, 100.0);
        Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: none }
    };
    for gives_up in [true, false] {
        let mut hands = Hands::new();
        hands.frame(vec![to(100.0)], none);
        let before = hands.session.view(SIZE);
        hands.frame(vec![button(100.0, true)], none);
        hands.frame(vec![to(140.0)], none);
        assert!(hands.frame(vec![to(180.0)], none), "it looks around");
        if gives_up {
            hands.frame(vec![key(Key::Escape, true, none)], none);
            assert!(!hands.frame(vec![to(220.0)], none), "the button is down, and does nothing more");
        }
        hands.frame(vec![button(220.0, false)], none);
        hands.frame(vec![], none);
        assert_eq!(hands.session.view(SIZE) == before, gives_up);
    }
}

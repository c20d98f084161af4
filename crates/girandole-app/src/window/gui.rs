//! egui between winit and wgpu.

use super::clock::Duration;
use super::surface::WindowSurface;
use super::target::PictureTarget;
use egui_wgpu::ScreenDescriptor;
use girandole::{Gpu, wgpu};
use std::path::PathBuf;
use winit::event::{DeviceId, Touch, WindowEvent};
use winit::window::Window;

const TEXT: egui::Color32 = egui::Color32::from_gray(190);

/// The panel's state, input and painter.
pub struct Gui {
    context: egui::Context,
    state: egui_winit::State,
    painter: egui_wgpu::Renderer,
}

/// A frame of it, not yet painted.
pub struct GuiFrame {
    textures: egui::TexturesDelta,
    shapes: Vec<egui::ClippedPrimitive>,
    pixels_per_point: f32,
    /// When the next one is due, though nothing happens.
    pub repaint_after: Duration,
}

impl Gui {
    /// With what a panel before it remembered.
    pub fn new(window: &Window, gpu: &Gpu, surface: &WindowSurface, memory: egui::Memory) -> Self {
        let context = egui::Context::default();
        context.memory_mut(|m| *m = memory);
        context.set_theme(egui::Theme::Dark);
        // The names of controls are to be read.
        context.all_styles_mut(|style| style.visuals.widgets.noninteractive.fg_stroke.color = TEXT);
        let most = gpu.device.limits().max_texture_dimension_2d as usize;
        let state = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(most),
        );
        let painter =
            egui_wgpu::Renderer::new(&gpu.device, surface.format(), egui_wgpu::RendererOptions::default());
        Self { context, state, painter }
    }

    /// Takes an event of the window. Returns whether a frame is due.
    pub fn on_event(&mut self, window: &Window, event: &WindowEvent) -> bool {
        let one_device = match event {
            // Browsers tell a device for each finger; egui knows hands by their device.
            WindowEvent::Touch(touch) => {
                Some(WindowEvent::Touch(Touch { device_id: DeviceId::dummy(), ..*touch }))
            }
            _ => None,
        };
        self.state.on_window_event(window, one_device.as_ref().unwrap_or(event)).repaint
    }

    /// Lays a frame out and lets it act.
    pub fn run(&mut self, window: &Window, contents: impl FnMut(&mut egui::Ui)) -> GuiFrame {
        let input = self.state.take_egui_input(window);
        let output = self.context.run_ui(input, contents);
        self.state.handle_platform_output(window, output.platform_output);
        let root = output.viewport_output.get(&egui::ViewportId::ROOT);
        GuiFrame {
            shapes: self.context.tessellate(output.shapes, output.pixels_per_point),
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
            repaint_after: root.map_or(Duration::MAX, |root| root.repaint_delay),
        }
    }

    /// What another panel needs to go on.
    pub fn memory(&self) -> egui::Memory {
        self.context.memory(egui::Memory::clone)
    }

    /// Where textures of the panel's are made.
    pub fn context(&self) -> &egui::Context {
        &self.context
    }

    /// Puts a text into the clipboard.
    pub fn copy(&mut self, text: String) {
        self.state.set_clipboard_text(text);
    }

    /// Files that were dropped on the window in the last frame.
    pub fn take_dropped_files(&self) -> Vec<PathBuf> {
        self.context.input(|input| input.raw.dropped_files.iter().map(|file| file.path().into()).collect())
    }

    /// Whether Shift is down.
    pub fn has_shift(&self) -> bool {
        self.context.input(|input| input.modifiers.shift)
    }

    /// Whether a control is being dragged or typed into.
    pub fn is_in_use(&self) -> bool {
        self.context.egui_is_using_pointer() || self.context.text_edit_focused()
    }

    /// Records a frame onto the window: the picture as it is, from the top left corner, and the panel beside and over it.
    pub fn paint(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (color, picture): (&wgpu::Texture, Option<&PictureTarget>),
        mut frame: GuiFrame,
    ) {
        let screen = ScreenDescriptor {
            size_in_pixels: [color.width(), color.height()],
            pixels_per_point: frame.pixels_per_point,
        };
        for (id, deltas) in &frame.textures.set {
            for delta in deltas {
                self.painter.update_texture(&gpu.device, &gpu.queue, *id, delta);
            }
        }
        self.painter.update_buffers(&gpu.device, &gpu.queue, encoder, &frame.shapes, &screen);
        let load = match picture {
            Some(picture) => {
                picture.copy_to(encoder, color);
                wgpu::LoadOp::Load
            }
            None => wgpu::LoadOp::Clear(wgpu::Color::BLACK),
        };
        let view = color.create_view(&Default::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        self.painter.render(&mut pass.forget_lifetime(), &frame.shapes, &screen);
        for id in &frame.textures.free {
            self.painter.free_texture(id);
        }
        frame.textures.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    /// Of what egui's own widgets show: icons of the colour picker, keys, an ellipsis, signs of numbers.
    const OF_WIDGETS: &str = "📋⏵⏷⏴⏶▶⏹…−°τ×✔⟲⚠";

    /// Characters beyond ASCII of a source file, without comments.
    fn characters(path: &Path, found: &mut BTreeSet<char>) {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).expect("a folder");
            return entries.for_each(|entry| characters(&entry.expect("an entry").path(), found));
        }
        let text = std::fs::read_to_string(path).expect("a source file");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        found.extend(code.flat_map(str::chars).filter(|c| !c.is_ascii()));
    }

    #[test]
    fn every_character_of_the_window_has_a_glyph() {
        let mut wanted: BTreeSet<char> = OF_WIDGETS.chars().collect();
        characters(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/window"), &mut wanted);
        assert!(wanted.contains(&'²') && wanted.len() > 10, "{wanted:?}");
        let context = egui::Context::default();
        context.run_ui(Default::default(), |_| {}).drop_without_applying_deltas();
        let font = egui::FontId::proportional(13.0);
        let missing = |c: &char| context.fonts_mut(|fonts| !fonts.has_glyph(&font, *c));
        assert!(missing(&'\u{6f22}'), "the control: fonts for other scripts are not there");
        let missing: Vec<char> = wanted.into_iter().filter(missing).collect();
        assert!(missing.is_empty(), "boxes are shown in place of {missing:?}");
    }
}

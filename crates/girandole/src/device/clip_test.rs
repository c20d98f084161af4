//! Whether a device clips by clip distances as it says it does. SwiftShader does not: whatever is drawn so has the nearest depth.

use super::readback::TextureCopy;

/// Texels across: a row of them is as long as copies to buffers ask for.
const SIZE: u32 = 64;

/// What shadow maps are drawn with: depth alone, in perspective, clipped at x = 0.
const SHADER: &str = "enable clip_distances;
struct Out { @builtin(position) position: vec4f, @builtin(clip_distances) clip: array<f32, 4> }
@vertex
fn corner(@builtin(vertex_index) index: u32) -> Out {
  let at = vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
  let w = 2.0 + f32(index);
  return Out(vec4f(at * w, 0.5, w), array<f32, 4>(at.x * w, 1.0, w, 1.0));
}";

/// Draws a triangle that is clipped to the right half, and looks what became of it. `false` also where that cannot be known.
pub(super) async fn passes(device: &wgpu::Device, queue: &wgpu::Queue) -> bool {
    let depth = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("clip test"),
        size: wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Depth32Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let view = depth.create_view(&Default::default());
    let pipeline = pipeline(device);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("clip test"),
        color_attachments: &[],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &view,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_pipeline(&pipeline);
    pass.draw(0..3, 0..1);
    drop(pass);
    let copy = TextureCopy::record(device, &mut encoder, &depth, wgpu::Origin3d::ZERO, [SIZE; 2], 4);
    queue.submit([encoder.finish()]);
    let words = copy.words();
    // Nobody else polls the device yet. In browsers it needs none of that.
    let polled = async { device.poll(wgpu::PollType::wait_indefinitely()).is_ok() };
    let Ok(words) = first_polled(words, polled).await else { return false };
    words.iter().enumerate().all(|(index, &word)| is_right([index as u32 % SIZE, index as u32 / SIZE], word))
}

/// The result of the first, which is begun before the second is awaited.
async fn first_polled<T>(first: impl Future<Output = T>, second: impl Future<Output = bool>) -> T {
    let mut first = std::pin::pin!(first);
    let begun = std::future::poll_fn(|context| std::task::Poll::Ready(first.as_mut().poll(context))).await;
    second.await;
    match begun {
        std::task::Poll::Ready(result) => result,
        std::task::Poll::Pending => first.await,
    }
}

/// Whether a texel has the depth that it should have, or lies at an edge.
fn is_right([x, y]: [u32; 2], word: u32) -> bool {
    let place = |i: u32| (i as f32 + 0.5) / SIZE as f32;
    // From the first corner, in units of the triangle's legs.
    let [u, v] = [place(x) * 0.5, (1.0 - place(y)) * 0.5];
    let from_edge = (x as i32 - (SIZE / 2) as i32).abs();
    if from_edge <= 1 {
        return true;
    }
    let inverse_w = [0.5, 1.0 / 3.0, 0.25];
    let depth = 0.5 * (inverse_w[0] * (1.0 - u - v) + inverse_w[1] * u + inverse_w[2] * v);
    let expected = if x >= SIZE / 2 { depth } else { 0.0 };
    (f32::from_bits(word) - expected).abs() < 1e-3
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("clip test"),
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("clip test"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_clipped_and_what_is_nearest_is_found_out() {
        let depth = |u: f32| (0.5 * (0.5 * (1.0 - u) + u / 3.0)).to_bits();
        let row = SIZE - 1;
        let u = |x: u32| (x as f32 + 0.5) / SIZE as f32 * 0.5;
        let v = 0.25 / SIZE as f32;
        assert!(is_right([60, row], (f32::from_bits(depth(u(60))) - v * 0.125).to_bits()));
        assert!(is_right([2, row], 0));
        assert!(!is_right([2, row], depth(u(2))), "not clipped");
        assert!(!is_right([60, row], 1f32.to_bits()), "nearest");
        assert!(!is_right([60, row], 0), "all clipped");
    }
}

// Of a worker: decodes a picture to RGBA that is not premultiplied.

let gl;

async function decode(bytes) {
  const picture = await createImageBitmap(new Blob([bytes]), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  const { width, height } = picture;
  gl ??= new OffscreenCanvas(1, 1).getContext("webgl2");
  if (!gl) throw new Error("this browser has no WebGL 2 to do it with");
  const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  if (Math.max(width, height) > most) throw new Error(`this browser takes ${most} pixels across`);
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
  picture.close();
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  const texels = new Uint8Array(width * height * 4);
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.PIXEL_PACK_BUFFER, buffer);
  gl.bufferData(gl.PIXEL_PACK_BUFFER, texels.length, gl.STREAM_READ);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, 0);
  const done = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  while (gl.clientWaitSync(done, 0, 0) === gl.TIMEOUT_EXPIRED) await new Promise((resolve) => setTimeout(resolve, 1));
  gl.getBufferSubData(gl.PIXEL_PACK_BUFFER, 0, texels);
  const error = gl.getError();
  gl.deleteSync(done);
  gl.deleteBuffer(buffer);
  gl.deleteFramebuffer(framebuffer);
  gl.deleteTexture(texture);
  if (error) throw new Error(`WebGL says ${error}`);
  return [width, height, texels];
}

onmessage = async ({ data }) => {
  try {
    const decoded = await decode(data);
    postMessage(decoded, [decoded[2].buffer]);
  } catch (error) {
    postMessage(error.message ?? `${error}`);
  }
};

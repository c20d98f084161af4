// The page around the window. The program (crates/girandole-app/src/page.rs) calls `page`; the page calls what that exports.

const cover = document.getElementById("cover");
const said = document.getElementById("said");
const share = document.getElementById("share");

globalThis.page = {
  fail(sentence) {
    cover.hidden = false;
    cover.className = "failed";
    said.textContent = sentence;
    console.error(sentence);
  },
  ready(hasPicture) {
    if (cover.className === "waits") cover.hidden = true;
    if (hasPicture && !performance.getEntriesByName("pictured").length) performance.mark("pictured");
  },
  save(name, bytes) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([bytes]));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  },
  copy(text) {
    navigator.clipboard?.writeText(text).catch(() => {});
  },
  address() {
    return location.search + location.hash;
  },
  setAddress(query) {
    const address = new URL(location.href);
    [address.search, address.hash = ""] = query.split("#");
    history.replaceState(null, "", address);
    performance.mark("settled");
    return address.href;
  },
};

// The program's bytes, with a bar that says how many of them are here.
async function bytes(address) {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`the server says ${response.status} to ${address}`);
  const total = Number(response.headers.get("content-length"));
  const isPacked = response.headers.has("content-encoding");
  const parts = [];
  let count = 0;
  for (const reader = response.body.getReader(); ; ) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    count += value.length;
    if (total && !isPacked) share.value = count / total;
    said.textContent = `Girandole is on its way: ${(count / 1e6).toFixed(1)} MB`;
  }
  return new Blob(parts).arrayBuffer();
}

// All files of what was dropped, folders included, with their paths.
async function filesOf(transfer) {
  const found = [];
  const walk = async (entry, folder) => {
    if (entry.isFile) {
      const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
      found.push([folder + file.name, file]);
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (entries.length === 0) break;
      for (const inner of entries) await walk(inner, `${folder}${entry.name}/`);
    }
  };
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.());
  if (entries.length > 0 && entries.every(Boolean)) {
    for (const entry of entries) await walk(entry, "");
  } else {
    for (const file of transfer.files) found.push([file.name, file]);
  }
  return found;
}

function takeDrops(program) {
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", async (event) => {
    event.preventDefault();
    const files = await filesOf(event.dataTransfer);
    for (const [path, file] of files) program.hold(path, new Uint8Array(await file.arrayBuffer()));
    program.dropped(files.map(([path]) => path));
  });
}

async function start() {
  if (!navigator.gpu) {
    return page.fail(
      "This browser has no WebGPU, by which this page would show the room above and let you walk through it: open it in Chrome or " +
        "Edge 113, Safari 26 or Firefox 141, or later ones, over https.",
    );
  }
  if (!(await navigator.gpu.requestAdapter())) {
    return page.fail(
      "This browser has WebGPU, but no GPU for it: switch hardware acceleration on in its settings, or update the GPU's driver.",
    );
  }
  const program = await import("./page.js");
  const module = await bytes("page_bg.wasm");
  performance.mark("loaded");
  share.removeAttribute("value");
  said.textContent = "Opening the device";
  await program.default({ module_or_path: module });
  takeDrops(program);
}

start().catch((error) => page.fail(`Girandole cannot be started: ${error.message ?? error}`));

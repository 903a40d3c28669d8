// Loads the client and hands its test hooks to the window. Everything else is in the wasm.
const play = document.getElementById("play");
// Before the client listens, the form would load the page again.
play.disabled = true;

try {
  const { default: init, drop_socket, own_place, particle_digests, rendered_sound, state, to_page } = await import("./client.js");
  await init();
  window.jostle = { drop_socket, own_place, particle_digests, rendered_sound, state, to_page };
  play.disabled = false;
} catch (error) {
  // No WebAssembly, or the download failed: say so instead of showing an empty page.
  const root = document.documentElement;
  root.dataset.state = "unsupported";
  document.getElementById("notice-title").textContent = "Couldn't start";
  document.getElementById("notice-text").textContent =
    "The game didn't load. Check your connection and that WebAssembly is allowed, then reload.";
  const button = document.getElementById("notice-button");
  button.textContent = "Reload";
  button.onclick = () => location.reload();
  document.getElementById("notice").hidden = false;
  console.warn(error);
}

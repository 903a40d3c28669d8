// Loads the client and exposes its test hooks on the window. Everything else is in the wasm module.
const play = document.getElementById("play");
// Until the client listens, submitting the form would reload the page.
play.disabled = true;

// A page around this one may ask for the game without buttons, names and news.
if (/[#&]bare=1/.test(location.hash)) {
  document.documentElement.dataset.bare = "yes";
}

try {
  const { default: init, drop_socket, own_place, particle_digests, rendered_sound, state, to_page } = await import("./client.js");
  await init();
  window.jostle = { drop_socket, own_place, particle_digests, rendered_sound, state, to_page };
  play.disabled = false;
} catch (error) {
  // WebAssembly is missing or the download failed: show an error instead of an empty page.
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

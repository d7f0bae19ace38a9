// The page: for now it shows that calls arrive.
const scene = await (await fetch("api/scene")).json();
document.body.textContent = scene.name;

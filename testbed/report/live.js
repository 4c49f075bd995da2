(() => {
  const root = document.getElementById("moving"), desk = document.getElementById("desk");
  const told = JSON.parse(document.getElementById("told").textContent);
  const find = name => desk.querySelector(`[name=${name}]`), cell = name => document.getElementById(name);
  let frames = 1;
  async function ask(path, body) {
    const answer = await fetch(path, {method: body ? "POST" : "GET", headers: {"X-Testbed": told.key},
      body: body ? JSON.stringify(body) : undefined});
    return answer.json();
  }
  async function order(body) {
    const answer = await ask("order", body);
    cell("answer").textContent = answer.refused || answer.done;
  }
  function show(now) {
    cell("state").textContent = `${now.t.toFixed(1)} s, ${now.state}`;
    find("pause").textContent = now.state === "paused" ? "Go on" : "Pause";
    for (const [name, text] of Object.entries(now.cells)) cell(name).textContent = text;
    cell("events").textContent = now.events.join("\n");
  }
  async function poll() {
    try {
      const now = await ask(`frames?after=${frames}`);
      frames += now.frames.length;
      if (now.frames.length) root.dispatchEvent(new CustomEvent("frames", {detail: now.frames}));
      show(now);
      if (now.state === "ended") return;
    } catch (error) { cell("state").textContent = "the run has ended"; return; }
    setTimeout(poll, 100);
  }
  find("pause").onclick = () => order({kind: "pause"});
  for (const rope of ["left", "right"]) find(`cut_${rope}`).onclick = () => order({kind: "cut_rope", rope});
  find("push").onclick = () => {
    const force = ["x", "y", "z"].map(axis => 1000 * find(`push_${axis}`).value);
    order({kind: "shove", at: find("push_at").value, force_in_world_n: force, duration_s: +find("push_s").value});
  };
  find("friction_set").onclick = () => order({kind: "set_friction", friction: +find("friction").value});
  poll();
})();

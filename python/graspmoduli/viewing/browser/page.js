// Runs once in the browser, beside viser's own client: the title, names for every control, the
// line of state over the picture, what happens when the server ends or WebGL is missing.
(() => {
  if (window.graspmoduli) return;
  window.graspmoduli = true;
  const name = "@NAME@";
  document.title = name + " – graspmoduli";
  document.documentElement.lang = "en";
  document.getElementById("root")?.setAttribute("role", "main");
  new MutationObserver(() => {
    if (!document.title.startsWith(name)) document.title = name + " – graspmoduli";
  }).observe(document.head, { childList: true, subtree: true, characterData: true });

  const style = document.createElement("style");
  style.textContent = `@STYLE@`;
  document.head.append(style);

  const bar = document.createElement("div");
  bar.id = "gm-state";
  bar.setAttribute("role", "status");
  bar.setAttribute("aria-live", "polite");
  const lost = document.createElement("div");
  lost.id = "gm-lost";
  lost.setAttribute("role", "alert");
  document.body.append(bar, lost);

  const say = (text) => { lost.textContent = text; lost.style.display = text ? "block" : "none"; };
  const canvas = document.createElement("canvas");
  if (!(canvas.getContext("webgl2") || canvas.getContext("webgl")))
    say("This browser has no WebGL: the scene cannot be drawn. The numbers in the panel are right.");

  // Every control is named by the words beside it.
  const wordsBeside = (element) => {
    for (let box = element.parentElement, k = 0; box && k < 7; box = box.parentElement, ++k) {
      const text = (box.innerText || "").trim().split("\n")[0].trim();
      if (text && !/^[-+0-9.\s]*$/.test(text) && text.length < 60) return text;
    }
    return "";
  };
  const named = () => {
    for (const element of document.querySelectorAll("input, [role=slider], button, [role=switch], select, canvas")) {
      const own = element.getAttribute("aria-label") || element.getAttribute("aria-labelledby");
      if (own || (element.tagName === "BUTTON" && element.innerText.trim())) continue;
      if (element.tagName === "CANVAS") {
        element.setAttribute("aria-label", "The object with its grasp; fingers are moved by the keys listed under Keyboard");
        element.setAttribute("role", "img");
        continue;
      }
      const words = wordsBeside(element);
      if (words) element.setAttribute("aria-label", words);
      else if (element.tagName === "BUTTON") element.setAttribute("aria-label", "panel");
    }
  };
  const text = (selector) => document.querySelector(selector)?.innerText || "";
  const said = { good: " · true on the object", bad: " · not true: see panel", unsure: " · not sure: see panel" };
  const refresh = () => {
    named();
    const value = text("[data-quality]");
    if (!value) return;
    const truth = document.querySelector("[data-truth]");
    const kind = truth ? truth.dataset.truth : "good";
    const shown = `Q ${value} · ${text("[data-closure]")}` + (truth ? said[kind] : "");
    if (bar.textContent !== shown) bar.textContent = shown;
    bar.className = kind === "good" ? "gm-good" : "gm-bad";
  };
  let planned = 0;
  new MutationObserver(() => {
    if (!planned) planned = setTimeout(() => { planned = 0; refresh(); }, 60);
  }).observe(document.body, { childList: true, subtree: true, characterData: true });
  refresh();

  // The server answers, or it has ended.
  const knock = async () => {
    const stop = new AbortController();
    try {
      await fetch(location.href, { cache: "no-store", signal: stop.signal });
      stop.abort();
      if (lost.dataset.ended) { delete lost.dataset.ended; say(""); }
    } catch {
      lost.dataset.ended = "yes";
      say("The viewer has ended: start graspmoduli view again and reload this page.");
    }
    setTimeout(knock, 3000);
  };
  setTimeout(knock, 3000);

  // What the server puts there to be copied.
  let copied = "";
  new MutationObserver(() => {
    const source = document.querySelector("[data-copy]");
    if (!source || source.textContent === copied) return;
    copied = source.textContent;
    navigator.clipboard?.writeText(copied);
  }).observe(document.body, { childList: true, subtree: true });
})();

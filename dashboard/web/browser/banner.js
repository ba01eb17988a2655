// Banner over the page: what a person must know before anything else. It outlives the server, and
// says when what the page shows is old, and who has the controls.
"use strict";
(() => {
  const RELOAD_AFTER = 2000; // ms after a closed connection after which the page is loaded anew
  const SILENCE_TIMEOUT = 10000; // ms without news on an open one: a busy browser is no lost server
  const CHECK_PERIOD = 500; // ms
  const START_TIME = 60; // s for which a lost connection is that of another cell's start
  const ENDED = "Lariat has ended or was started anew: open the address that it printed last.";

  const narrow = window.matchMedia("(max-width: 700px)"); // a phone, which only watches
  const elements = {};
  let news = null;
  let newsTime = performance.now();
  let connected = true;
  let closed = false; // whether the connection was closed since the last news
  let admitted = true;
  let checking = false;

  function seconds() {
    return Math.round((performance.now() - newsTime) / 1000);
  }

  // The first line that applies: kind of the banner, text, buttons by label.
  function line() {
    if (!admitted) return ["lost", ENDED, {}];
    if (!connected && news?.cell.activity && seconds() < START_TIME) {
      return ["lost", "Another cell starts; the page comes back by itself. What you see is old.", {}];
    }
    if (!connected) {
      const text = `No connection to the dashboard for ${seconds()} s. What you see is old.`;
      return ["lost", `${text} Connecting again …`, {}];
    }
    if (!news) return ["watching", "Connecting …", {}];
    if (news.cell.silent) return ["lost", `${news.cell.silent}. What you see is old.`, {}];
    const { role, asks, asked } = news.controls;
    if (narrow.matches) return ["watching", "A window as narrow as this only watches; HOLD works.", {}];
    if (role === "holder" && asked) {
      const text = "Another window asks for the controls; without an answer it gets them.";
      return ["asked", text, { "Give them": answer(true), "Keep them": answer(false) }];
    }
    if (role === "holder") return null;
    const text = role === "free" ? "Nobody has the controls." : "Another window has the controls; you watch.";
    if (asks) return ["watching", `${text} It has been asked.`, {}];
    const label = role === "free" ? "Take the controls" : "Ask for the controls";
    return ["watching", text, { [label]: () => say({ type: "ask" }) }];
  }

  function say(message) {
    window.dispatchEvent(new CustomEvent("lariat-say", { detail: message }));
  }

  function answer(give) {
    return () => say({ type: "answer", give });
  }

  function show() {
    if (!elements.banner) return;
    const [kind, text, buttons] = line() ?? ["", "", {}];
    const watching = narrow.matches || (news !== null && news.controls.role !== "holder");
    document.documentElement.classList.toggle("has-banner", kind !== "");
    document.documentElement.classList.toggle("is-lost", kind === "lost");
    document.documentElement.classList.toggle("is-watching", watching);
    elements.banner.hidden = kind === "";
    elements.banner.dataset.kind = kind;
    elements.text.textContent = text;
    const labels = Object.keys(buttons).join("|");
    if (elements.buttons.dataset.labels === labels) return;
    elements.buttons.dataset.labels = labels;
    elements.buttons.replaceChildren(
      ...Object.entries(buttons).map(([label, press]) => {
        const button = document.createElement("button");
        button.textContent = label;
        button.addEventListener("click", press);
        return button;
      }),
    );
  }

  // Whether the server is there and still knows this window; once it is back, the page begins anew.
  async function check() {
    if (connected || checking) return;
    checking = true;
    try {
      const reply = await fetch(location.href, {
        cache: "no-store",
        signal: AbortSignal.timeout(2 * CHECK_PERIOD),
      });
      const patience = closed ? RELOAD_AFTER : SILENCE_TIMEOUT;
      if (reply.ok && performance.now() - newsTime > patience) location.reload();
      admitted = reply.status !== 403 && reply.status !== 404;
    } catch {
      admitted = true;
    }
    checking = false;
    show();
  }

  function build() {
    const banner = document.createElement("section");
    banner.id = "banner";
    banner.setAttribute("role", "alert");
    banner.hidden = true;
    elements.text = banner.appendChild(document.createElement("span"));
    elements.buttons = banner.appendChild(document.createElement("span"));
    elements.banner = banner;
    document.body.append(banner);
    show();
  }

  window.addEventListener("lariat-news", (event) => {
    news = event.detail;
    // It was another server's page.
    if (closed && performance.now() - newsTime > RELOAD_AFTER) location.reload();
    const { role, asked } = news.controls;
    if (narrow.matches && role === "holder" && asked) say({ type: "answer", give: true });
    newsTime = performance.now();
    connected = admitted = true;
    closed = false;
    show();
  });
  window.addEventListener("lariat-lost", (event) => {
    connected = false;
    closed ||= event.detail?.closed === true;
    show();
  });
  narrow.addEventListener("change", show);
  setInterval(check, CHECK_PERIOD);
  document.addEventListener("DOMContentLoaded", build);
})();

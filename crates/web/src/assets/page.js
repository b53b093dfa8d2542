// Keeps a page up to date: parts of it come as they change, by server-sent events or, where there are too many of
// these, by polling. Without this script the page is whole, and as of its time.
"use strict";
(() => {
  // A forced reset discards a fault that is still there.
  document.addEventListener("submit", (event) => {
    const forced = event.target.querySelector("[name=force]:checked");
    if (forced && !confirm("The fault has not gone. Reset it all the same?")) event.preventDefault();
  });
  // What was typed into an order survives a session that has ended meanwhile, until an order was carried out.
  const typed = (field) => `typed ${location.pathname} ${field.form.getAttribute("action")} ${field.name}`;
  const texts = document.querySelectorAll("form[action*='/order/'] input[type=text]");
  const isDone = document.querySelector(".message:not(.refused)") !== null;
  for (const field of texts) {
    const before = sessionStorage.getItem(typed(field));
    if (isDone) sessionStorage.removeItem(typed(field));
    else if (before) field.value = before;
    field.addEventListener("input", () => sessionStorage.setItem(typed(field), field.value));
  }
  // A replay goes on by itself, a second per event, until the last one.
  const next = document.querySelector("a[rel=next]"), steps = document.querySelector(".steps");
  if (steps) {
    const play = document.createElement("button");
    const isPlaying = () => sessionStorage.getItem("replay") === "on";
    const label = () => { play.textContent = isPlaying() && next ? "pause" : "play"; };
    play.addEventListener("click", () => {
      sessionStorage.setItem("replay", isPlaying() ? "off" : "on");
      label();
      if (isPlaying() && next) location.replace(next.href);
    });
    if (!next) sessionStorage.setItem("replay", "off");
    steps.append(play);
    label();
    setTimeout(() => { if (isPlaying() && next) location.replace(next.href); }, 1000);
  }
  const wanted = document.body.dataset.live;
  const live = document.getElementById("live");
  // Where the site begins: a proxy may have it under a path.
  const base = document.currentScript.src.replace(/\/page\.js$/, "");
  if (!wanted || !live) return;
  const SILENT_MS = 5000, RENEW_MS = 12000, POLL_MS = 2000, STREAM_AGAIN_MS = 30000, HIDDEN_POLL_MS = 5000;
  let stream = null, polling = null, last = performance.now(), opened = last, signedOut = false;
  const signIn = document.createElement("a");
  signIn.href = `${base}/sign-in`;

  const replace = (element, html) => {
    // Whoever uses the keyboard stays where he was.
    const active = element.contains(document.activeElement) ? document.activeElement : null;
    const name = active?.getAttribute("href") ? "href" : active?.getAttribute("value") ? "value" : null;
    const kept = name && `${active.localName}[${name}="${CSS.escape(active.getAttribute(name))}"]`;
    // What was selected stays selected.
    const selected = [...element.querySelectorAll("input:checked")].map((box) => box.value);
    element.innerHTML = html;
    for (const box of element.querySelectorAll("input[type=checkbox]")) box.checked = selected.includes(box.value);
    if (kept) element.querySelector(kept)?.focus();
  };
  const take = (parts) => {
    [last, signedOut] = [performance.now(), false];
    for (const { id, html } of parts) {
      const element = document.getElementById(id);
      if (id === "icon") element.href = base + html;
      else if (element) replace(element, html);
    }
    offer();
    date();
    show();
    signal();
  };
  // Only the orders that are possible in the present state.
  const offer = () => {
    const verdict = document.querySelector("#summary .verdict");
    if (!verdict) return;
    const present = [...verdict.classList, verdict.classList.contains("aside") ? "aside" : "plain"];
    for (const form of document.querySelectorAll("form[data-for]")) {
      form.hidden = !form.dataset.for.split(" ").some((state) => present.includes(state));
    }
  };
  // Ages first, then the time on this computer's clock; UTC stays in the tooltip.
  const clockOf = new Intl.DateTimeFormat(undefined, { dateStyle: "medium", timeStyle: "long" });
  const ageOf = (seconds) => seconds < 100 ? `${seconds} s` : seconds < 6000 ? `${Math.round(seconds / 60)} min`
    : seconds < 172800 ? `${Math.round(seconds / 3600)} h` : `${Math.round(seconds / 86400)} days`;
  const date = () => {
    for (const time of document.querySelectorAll("main .meta time, main .facts time")) {
      const at = Date.parse(time.dateTime), seconds = Math.max(0, Math.round((Date.now() - at) / 1000));
      const text = `${ageOf(seconds)} ago, ${clockOf.format(at)}`;
      if (time.textContent !== text) time.textContent = text;
    }
  };

  // A further alarm is signalled by the browser, for who wants that: once, and not what was there before.
  const count = () => Number(/^\((\d+)\)/.exec(document.title)?.[1] ?? 0);
  const ways = { off: "no signal", note: "signal alarms", sound: "signal alarms with a sound" };
  const bell = document.createElement("select");
  bell.setAttribute("aria-label", "Signal of new alarms");
  for (const [way, words] of Object.entries(ways)) bell.add(new Option(words, way));
  bell.value = localStorage.getItem("signal") ?? "off";
  bell.addEventListener("change", async () => {
    if (bell.value !== "off" && "Notification" in window) await Notification.requestPermission();
    localStorage.setItem("signal", bell.value);
    if (bell.value === "sound") beep();
  });
  document.querySelector(".bar .right").prepend(bell);
  const beep = () => {
    const sound = new AudioContext();
    for (const at of [0, 0.3, 0.6]) {
      const tone = sound.createOscillator(), volume = sound.createGain();
      [tone.frequency.value, volume.gain.value] = [880, 0.2];
      tone.connect(volume).connect(sound.destination);
      tone.start(sound.currentTime + at);
      tone.stop(sound.currentTime + at + 0.15);
    }
    setTimeout(() => sound.close(), 1500);
  };
  let counted = count();
  const signal = () => {
    const before = counted;
    counted = count();
    if (counted <= before || bell.value === "off") return;
    const first = document.querySelector("#alarms .alarm, #incidents .alarm")?.innerText.replace(/\s+/g, " ") ?? "";
    // Some browsers notify only by a service worker; the title and the icon tell of the alarm all the same.
    try { new Notification(document.title, { body: first, icon: document.getElementById("icon").href, tag: "trusswatch" }); }
    catch { /* see above */ }
    if (bell.value === "sound") beep();
  };

  const poll = async () => {
    try {
      const answer = await fetch(`${base}/fragments?${wanted}`, { cache: "no-store", signal: AbortSignal.timeout(4000) });
      // The session has ended. One begun in another tab brings the page back.
      if (answer.status === 401) signedOut = true;
      if (answer.ok) take(await answer.json());
    } catch { /* The age of what is shown says it. */ }
  };
  const fallBack = () => {
    if (polling) return;
    poll();
    polling = setInterval(poll, POLL_MS);
    setTimeout(open, STREAM_AGAIN_MS);
  };
  const stop = () => {
    stream?.close();
    clearInterval(polling);
    stream = polling = null;
  };
  function open() {
    if (document.hidden) return;
    stop();
    opened = performance.now();
    stream = new EventSource(`${base}/stream?${wanted}`);
    stream.onmessage = (event) => take(JSON.parse(event.data));
    // A refusal closes it for good; a lost connection is opened again by the browser.
    stream.onerror = () => { if (stream?.readyState === EventSource.CLOSED) { stop(); fallBack(); } };
  }

  // How old what is shown is, at every moment.
  const words = document.createElement("span"), clock = document.getElementById("clock");
  live.replaceChildren(signIn, words, clock);
  const show = () => {
    const now = performance.now(), age = now - last, silent = age > SILENT_MS;
    // The page's own server may be without a network, and say so at once.
    const lost = silent || signedOut || document.querySelector("#network [data-cut-off]") !== null;
    document.body.classList.toggle("lost", lost);
    live.dataset.age = Math.round(age / 1000);
    document.getElementById("person").hidden = signedOut;
    [signIn.hidden, signIn.textContent] = [!signedOut, signedOut ? "sign in again" : ""];
    const old = signedOut ? "this session has ended" : silent ? `nothing new for ${Math.round(age / 1000)} s` : "cut off from the network";
    words.textContent = lost ? `${signedOut ? " · " : ""}NOT LIVE: ${old}, as of ` : "live ";
    // A connection that is open and carries nothing.
    if (stream && age > RENEW_MS && now - opened > RENEW_MS) open();
  };
  setInterval(show, 500);
  setInterval(date, 5000);
  // A hidden page has no stream; its title and icon still tell of an alarm.
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden) return open();
    stop();
    polling = setInterval(poll, HIDDEN_POLL_MS);
  });
  addEventListener("pagehide", stop);
  addEventListener("pageshow", (event) => { if (event.persisted) open(); });
  open();
  date();
  show();
})();

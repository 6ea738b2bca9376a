// Whether this tab is seen. A browser keeps few connections to one service (six over HTTP/1.1) for all its tabs together,
// so a hidden tab keeps none open: a stop that is asked for in another tab must not wait for one.

/**
 * A signal that aborts as soon as the tab is hidden, and with `signal`.
 * @param {AbortSignal} signal
 */
export function whileVisible(signal) {
  const hidden = new AbortController();
  const check = () => document.hidden && hidden.abort();
  document.addEventListener("visibilitychange", check, { signal: AbortSignal.any([signal, hidden.signal]) });
  check();
  return AbortSignal.any([signal, hidden.signal]);
}

/**
 * Wait until the tab is seen, or until `signal` aborts.
 * @param {AbortSignal} signal
 */
export async function untilVisible(signal) {
  while (document.hidden && !signal.aborted)
    await new Promise((resolve) => {
      document.addEventListener("visibilitychange", resolve, { once: true });
      signal.addEventListener("abort", resolve, { once: true });
    });
}

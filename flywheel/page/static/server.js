// Calls to the server that this page comes from. Addresses are relative, so the page works below any prefix.

let reached = "yes"; // "no": nobody answers; "other": somebody does who does not know this page
let notify = () => {};

/** Call `listener(reached)` whenever that changes: "yes", "no" where nobody answers, "other" where another start does. */
export function onContact(listener) {
  notify = listener;
}

/** Whether the server answers: "yes", "no" or "other". */
export function reach() {
  return reached;
}

/** Send a call; {status, data}. An error where the server of this page does not answer, or `signal` ended the call. */
export async function call(name, body, signal) {
  const response = await send(name, body, signal);
  return { status: response.status, data: await content(response) };
}

/** Ask for a file; a Blob, or an Error with the server's reason. */
export async function file(name, body) {
  const response = await send(name, body);
  if (response.ok) return response.blob();
  const data = await content(response);
  throw new Error(data?.message ?? data?.error ?? response.statusText);
}

async function content(response) {
  const json = response.headers.get("Content-Type")?.includes("json");
  return json ? response.json() : { message: await response.text() };
}

async function send(name, body, signal) {
  const options = { cache: "no-store", signal };
  if (body !== undefined) {
    Object.assign(options, { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } });
  }
  let response;
  try {
    response = await fetch(`api/${name}`, options);
  } catch (error) {
    if (error.name !== "AbortError") contact("no");
    throw error;
  }
  contact(response.status === 404 ? "other" : "yes"); // every call of this page's own server is known to it
  if (response.status === 404) throw new Error(response.statusText);
  return response;
}

function contact(now) {
  if (now === reached) return;
  reached = now;
  notify(now);
}

// Calls to the server that this page comes from. Addresses are relative, so the page works below any prefix.

let reached = true;
let told = () => {};

/** Call `listener(reached)` whenever the server stops or begins to answer. */
export function onContact(listener) {
  told = listener;
}

/** Send a call; {status, data}. An error where nobody answers, or where `signal` ended the call. */
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
  try {
    const response = await fetch(`api/${name}`, options);
    contact(true);
    return response;
  } catch (error) {
    if (error.name !== "AbortError") contact(false);
    throw error;
  }
}

function contact(now) {
  if (now === reached) return;
  reached = now;
  told(now);
}

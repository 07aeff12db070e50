// @ts-check
/** The way in: where the server asks for a token, that of the address, of before a reload, or of the visitor. */

import { ApiError, useToken } from "./api.js";

const KEPT = "relit-token"; // key of what outlives a reload, and is for this tab alone
const IN_ADDRESS = "#token=";

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

/**
 * Ask the server something, with a token once it wants one.
 * @template T @param {() => Promise<T>} question @returns {Promise<T>}
 */
export async function entered(question) {
  if (location.hash.startsWith(IN_ADDRESS)) {
    sessionStorage.setItem(KEPT, location.hash.slice(IN_ADDRESS.length));
    // It is not to be copied with the address, nor to stay in the history.
    history.replaceState(null, "", location.pathname);
  }
  let token = sessionStorage.getItem(KEPT) ?? "";
  for (;;) {
    useToken(token);
    try {
      const answer = await question();
      if (token) sessionStorage.setItem(KEPT, token);
      return answer;
    } catch (error) {
      if (!(error instanceof ApiError && error.status === 401)) throw error;
      token = await asked(token ? error.message : "");
    }
  }
}

/** The token that a visitor gives. @param {string} problem @returns {Promise<string>} */
function asked(problem) {
  $("token-problem").textContent = problem;
  $("way-in").showModal();
  return new Promise((go) => {
    $("way-in").oncancel = (/** @type {Event} */ event) => event.preventDefault(); // without it, there is no page
    $("way-in").querySelector("form").onsubmit = (/** @type {Event} */ event) => {
      event.preventDefault();
      $("way-in").close();
      go($("token").value);
    };
  });
}

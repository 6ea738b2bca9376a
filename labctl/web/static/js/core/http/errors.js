// Errors of requests, and what a page says of them.

/** @import { MissingFact, ProblemDocument, Warning } from "../../../../types/api.js" */

/** A problem document of the service (RFC 9457): `status`, `type`, `title`, and `detail` as the message. */
export class Problem extends Error {
  /**
   * @param {ProblemDocument} document
   * @param {number} [retry_after_s] when to ask again, where the service says so
   */
  constructor(document, retry_after_s = 0) {
    super(document.detail || document.title || "the service gave no reason");
    this.retry_after_s = retry_after_s;
    this.status = document.status;
    this.type = document.type;
    this.title = document.title;
    /** @type {Warning[] | undefined} */
    this.warnings = document.warnings;
    /** @type {string[] | undefined} */
    this.problems = document.problems;
    /** What is wrong, with its place in the request. @type {{ place: string[], text: string }[] | undefined} */
    this.errors = document.errors;
    /** @type {MissingFact[] | undefined} */
    this.missing = document.missing;
  }
}

/** The service did not answer. */
export class Unreachable extends Error {
  constructor() {
    super(
      "The service does not answer. The page shows the last answer, and is updated when the service answers again.",
    );
  }
}

/**
 * Whether a request was cancelled, as it is when the page is left.
 * @param {unknown} error
 */
export const isAbort = (error) => error instanceof Error && error.name === "AbortError";

/** @param {unknown} error */
export const messageOf = (error) => (error instanceof Error ? error.message : String(error));

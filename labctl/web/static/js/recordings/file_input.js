// Files that a person lets go over the page or picks: single ones, or a folder of them.

/** What a recording's files are called; in a folder the rest is left lying. */
const RECORDING_FILE = /^(recording\.toml|(samples|points|coefficients|environment)\.(csv|parquet))$/;

/** The files of a drop, with `left`: the names in its folders that belong to no recording. */
export async function droppedFiles(transfer) {
  // the entries are gone after the first await
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.some((entry) => entry.isDirectory)) return { files: [...transfer.files], left: [] };
  const all = (await Promise.all(entries.map((entry) => (entry.isDirectory ? inFolder(entry) : asFile(entry).then((file) => [file]))))).flat();
  return recordingFiles(all);
}

/** What of a folder is part of a recording. */
export function recordingFiles(files) {
  const own = files.filter((file) => RECORDING_FILE.test(file.name));
  return { files: own, left: files.filter((file) => !own.includes(file)).map((file) => file.name) };
}

const asFile = (entry) => new Promise((resolve, reject) => entry.file(resolve, reject));

async function inFolder(folder) {
  const reader = folder.createReader();
  const files = [];
  for (;;) { // a reader gives at most a hundred at a time
    const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!entries.length) return files;
    files.push(...(await Promise.all(entries.filter((entry) => entry.isFile).map(asFile))));
  }
}

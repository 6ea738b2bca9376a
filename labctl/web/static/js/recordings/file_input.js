// Files from a drop or a file input: single files or a folder.

/** File names of a recording; other files of a folder are ignored. */
const RECORDING_FILE = /^(recording\.toml|(samples|points|coefficients|environment)\.(csv|parquet))$/;

/**
 * The files of a drop, and `left`: the names in its folders that belong to no recording.
 * @param {DataTransfer} transfer
 */
export async function droppedFiles(transfer) {
  // entries are valid only until the first await
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter((entry) => entry !== null);
  if (!entries.some(isFolder)) return { files: [...transfer.files], left: [] };
  const all = (
    await Promise.all(
      entries.map((entry) =>
        isFolder(entry) ? inFolder(entry) : isFile(entry) ? asFile(entry).then((file) => [file]) : [],
      ),
    )
  ).flat();
  return recordingFiles(all);
}

/**
 * The files of a folder that belong to a recording, and the names of the others.
 * @template {{ name: string }} F
 * @param {readonly F[]} files
 */
export function recordingFiles(files) {
  const own = files.filter((file) => RECORDING_FILE.test(file.name));
  return { files: own, left: files.filter((file) => !own.includes(file)).map((file) => file.name) };
}

/**
 * Whether what was chosen is one log in a format of others, and not a recording.
 * @param {readonly { name: string }[]} files
 */
export const isLog = (files) => files.length === 1 && files[0].name !== "recording.toml";

/**
 * @param {FileSystemEntry} entry
 * @returns {entry is FileSystemDirectoryEntry}
 */
const isFolder = (entry) => entry.isDirectory;
/**
 * @param {FileSystemEntry} entry
 * @returns {entry is FileSystemFileEntry}
 */
const isFile = (entry) => entry.isFile;
/**
 * @param {FileSystemFileEntry} entry
 * @returns {Promise<File>}
 */
const asFile = (entry) => new Promise((resolve, reject) => entry.file(resolve, reject));

/** @param {FileSystemDirectoryEntry} folder */
async function inFolder(folder) {
  const reader = folder.createReader();
  /** @type {File[]} */
  const files = [];
  for (;;) {
    // readEntries returns at most 100 entries per call
    /** @type {FileSystemEntry[]} */
    const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!entries.length) return files;
    files.push(...(await Promise.all(entries.filter(isFile).map(asFile))));
  }
}

// What was measured, when and where: the commit that was built, and how busy the machine was.
import { execFileSync } from 'node:child_process';
import os from 'node:os';
import { fileURLToPath } from 'node:url';

const git = (...args) => execFileSync('git', args, { cwd: fileURLToPath(new URL('..', import.meta.url)), encoding: 'utf8' }).trim();

export function madeAt() {
  const changed = git('status', '--porcelain', '--untracked-files=no', '--', 'decoder', 'encoder') !== '';
  return {
    commit: git('rev-parse', '--short=12', 'HEAD') + (changed ? ' with uncommitted changes' : ''),
    date: new Date().toISOString().slice(0, 10),
    machine: `${os.cpus()[0].model}, ${os.cpus().length} cores`,
    load: os.loadavg()[1].toFixed(1),  // mean over five minutes, of which the bench itself is up to one a thread
  };
}

// As a heading of results says it.
export const madeText = ({ commit, date, machine, load }) => `at commit ${commit} on ${date} (${machine}; load ${load})`;

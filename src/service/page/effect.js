// What a remedy did beside removing its finding: a line at the foot of the window, in sight wherever the remedy was pressed.

import { byId, setProperties, setText } from './dom.js';
import { kindOf } from './findings.js';
import { listed, small, t } from './texts.js';
import { effectOn } from './tiles.js';
import { sentence } from './words.js';

/** `remedied` is `{ finding, answers }`, the finding and the answers before; without it the line goes. */
export function showEffect(remedied, findings, answers) {
  const line = byId('effect');
  setProperties(line, { hidden: !remedied });
  if (!remedied) return;
  const { code } = remedied.finding;
  const title = kindOf(remedied.finding);
  const effects = listed(effectOn(remedied.answers, answers).map(small));
  const outcome = findings.some((finding) => finding.code === code) ? t('remedy.stays', { title }) : t('remedy.gone', { title });
  setText(byId('effect-text'), effects ? `${outcome} ${sentence(effects)}` : outcome);
}

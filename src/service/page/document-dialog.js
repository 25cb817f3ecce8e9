// The design document as text: to read, to edit, from and to a file.

import { copy } from './clipboard.js';
import { converted } from './convert.js';
import { byId, setText } from './dom.js';
import * as share from './share.js';

/** `design()` is the one at hand, `nameOf(ending)` names its file; `onTake(design, { title, isConverted })` when another was read, with the title
 *  of its file where it comes from one. */
export function listenToDocument({ design, nameOf, onTake }) {
  const [dialog, area, error] = ['document', 'document-text', 'document-error'].map(byId);
  const show = (text) => {
    area.value = text;
    error.hidden = true;
    dialog.showModal();
  };
  const take = (text, title) => {
    try {
      const read = share.fromText(text);
      const next = converted(read);
      onTake(next, { title, isConverted: next !== read });
      error.hidden = true;
      dialog.close();
    } catch (failure) {
      // The text is there to be mended.
      if (!dialog.open) show(text);
      error.hidden = false;
      setText(error, failure.message);
    }
  };
  const click = (id, action) => byId(id).addEventListener('click', action);
  click('open-document', () => show(share.toText(design())));
  click('document-close', () => dialog.close());
  click('document-apply', () => take(area.value));
  click('document-copy', ({ currentTarget }) => copy(area.value, currentTarget));
  click('save', () => share.save(share.toFile(design()), nameOf('.json')));
  click('load', () => byId('document-file').click());
  byId('document-file').addEventListener('change', async ({ currentTarget: input }) => {
    const [file] = input.files;
    if (file) take(await file.text(), share.titleOfFile(file.name));
    input.value = '';
  });
}

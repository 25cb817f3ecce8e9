// The key that a service may want.

import * as access from './access.js';
import { byId, setText } from './dom.js';
import { t } from './texts.js';

function ask(detail, isWrong) {
  byId('login').hidden = false;
  setText(byId('login-detail'), isWrong ? t('login.wrong') : t('login.wanted'));
  byId('login-key').focus();
  byId('login-key').select();
  setText(byId('announcer'), detail ?? '');
}

export function listenToLogin() {
  byId('login').addEventListener('submit', (event) => {
    event.preventDefault();
    byId('login').hidden = true;
    access.open(byId('login-key').value.trim());
    byId('login-key').value = '';
  });
  access.listen(ask);
}

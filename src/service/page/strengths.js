// Strengths of carrier materials by name, as documents take them; `GET /v1/materials` has their numbers and sources.

import { t } from './texts.js';

const NAMES = ['42crmo4-qt', '42crmo4-qt-40', '42crmo4-qt-100', 'c45-qt', 'c45-n', '100cr6', 'en-aw-7075-t6'];

export const STRENGTHS = NAMES.map((value) => ({ value, label: t(`option./parts/carrier/strength.${value}`) }));

// Strengths of carrier materials by name, as documents take them; `GET /v1/materials` has their numbers and sources.

export const STRENGTHS = [
  { value: '42crmo4-qt', label: '42CrMo4 +QT, up to 16 mm' },
  { value: '42crmo4-qt-40', label: '42CrMo4 +QT, 16 to 40 mm' },
  { value: '42crmo4-qt-100', label: '42CrMo4 +QT, 40 to 100 mm' },
  { value: 'c45-qt', label: 'C45 +QT, up to 16 mm' },
  { value: 'c45-n', label: 'C45 +N, up to 16 mm' },
  { value: '100cr6', label: '100Cr6, hardened' },
  { value: 'en-aw-7075-t6', label: 'Aluminium EN AW-7075-T6' },
];

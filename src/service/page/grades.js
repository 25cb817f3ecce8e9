// Standard tolerance grades of ISO 286-1, in µm.

/** Up to these diameters in mm each row's values hold. */
const UP_TO_MM = [3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500];
const GRADES = {
  IT5: [4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27],
  IT6: [6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40],
  IT7: [10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63],
  IT8: [14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97],
  IT9: [25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155],
};

export const GRADE_NAMES = Object.keys(GRADES);

/** The tolerance of a grade for a diameter; above the largest one of the table that of the largest. */
export function toleranceUm(grade, diameterMm) {
  const row = UP_TO_MM.findIndex((most) => diameterMm <= most);
  return GRADES[grade].at(row);
}

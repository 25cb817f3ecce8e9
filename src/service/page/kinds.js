// Kinds of the design document with their fields. Written by tests/docs/generate.py from the API document.
export const KINDS = {
 "/drive/wave_generator": {
  "ellipse": [
   { "pointer": "/drive/wave_generator/semi_major_mm", "unit": "mm", "meaning": "Semi-major axis a, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true },
   { "pointer": "/drive/wave_generator/semi_minor_mm", "unit": "mm", "meaning": "Semi-minor axis b, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ],
  "eccentric": [
   { "pointer": "/drive/wave_generator/eccentricity_mm", "unit": "mm", "meaning": "Distance e of its centre from the axis, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true },
   { "pointer": "/drive/wave_generator/radius_mm", "unit": "mm", "meaning": "Radius R0 of the circle, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ],
  "harmonic": [
   { "pointer": "/drive/wave_generator/amplitude_mm", "unit": "mm", "meaning": "Amplitude e, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true },
   { "pointer": "/drive/wave_generator/lobes", "unit": "", "meaning": "Lobes U: teeth pass as many meshing zones in a turn. With one the cam is an `eccentric`.", "low": 2, "high": 1000, "is_whole": true, "is_required": true },
   { "pointer": "/drive/wave_generator/mean_radius_mm", "unit": "mm", "meaning": "Mean radius R0, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ],
  "harmonic_path": [
   { "pointer": "/drive/wave_generator/amplitude_mm", "unit": "mm", "meaning": "Amplitude e, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true },
   { "pointer": "/drive/wave_generator/lobes", "unit": "", "meaning": "Number of lobes U, and of meshing zones.", "low": 1, "high": 1000, "is_whole": true, "is_required": true },
   { "pointer": "/drive/wave_generator/mean_path_radius_mm", "unit": "mm", "meaning": "Mean radius R of the path, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ]
 },
 "/drive/teeth": {
  "cylinder": [
   { "pointer": "/drive/teeth/width_mm", "unit": "mm", "meaning": "Width L1 of a tooth along the axis, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ],
  "ball": [
   { "pointer": "/drive/teeth/groove_radius_mm/carrier", "unit": "mm", "meaning": "At the carrier, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": false },
   { "pointer": "/drive/teeth/groove_radius_mm/ring", "unit": "mm", "meaning": "At the ring, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": false },
   { "pointer": "/drive/teeth/groove_radius_mm/wave_generator", "unit": "mm", "meaning": "At the wave generator, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": false }
  ],
  "flat_sided": [
   { "pointer": "/drive/teeth/flat_length_mm", "unit": "mm", "meaning": "Length l of a flat along the slot, in mm. It must be below the tooth's diameter.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true },
   { "pointer": "/drive/teeth/width_mm", "unit": "mm", "meaning": "Width L1 of a tooth along the axis, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ]
 },
 "/model/stiffness": {
  "linear": [],
  "fixed": [
   { "pointer": "/model/stiffness/carrier_n_per_mm", "unit": "N/mm", "meaning": "Stiffness at the carrier, in N/mm.", "low": 0.001, "high": 1000000000000000, "is_whole": false, "is_required": true },
   { "pointer": "/model/stiffness/ring_n_per_mm", "unit": "N/mm", "meaning": "Stiffness at the ring, in N/mm.", "low": 0.001, "high": 1000000000000000, "is_whole": false, "is_required": true },
   { "pointer": "/model/stiffness/wave_generator_n_per_mm", "unit": "N/mm", "meaning": "Stiffness at the wave generator, in N/mm.", "low": 0.001, "high": 1000000000000000, "is_whole": false, "is_required": true }
  ],
  "palmgren": [],
  "johnson": [
   { "pointer": "/model/stiffness/depth_mm/carrier", "unit": "mm", "meaning": "At the carrier, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": false },
   { "pointer": "/model/stiffness/depth_mm/ring", "unit": "mm", "meaning": "At the ring, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": false },
   { "pointer": "/model/stiffness/depth_mm/wave_generator", "unit": "mm", "meaning": "At the wave generator, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": false }
  ],
  "hertz": []
 },
 "/friction/wave_generator": {
  "plain": [],
  "race": [
   { "pointer": "/friction/wave_generator/bearing_coefficient", "unit": "", "meaning": "Coefficient of friction μ_b of the bearing, from 0 to 1: friction torque over load times `bearing_radius_mm`.", "low": 0, "high": 1, "is_whole": false, "is_required": true },
   { "pointer": "/friction/wave_generator/bearing_element", "unit": "", "meaning": "Rolling element of the bearing. Default: ball.", "choices": [ "ball", "roller" ] },
   { "pointer": "/friction/wave_generator/bearing_load_rating_n", "unit": "N", "meaning": "Dynamic load rating C of the bearing, in N, for its life by ISO 281. Only for the bearing of an eccentric circle. Default: no life is calculated.", "low": 0.001, "high": 1000000000000, "is_whole": false, "is_required": false },
   { "pointer": "/friction/wave_generator/bearing_radius_mm", "unit": "mm", "meaning": "Radius R_b for the bearing's coefficient of friction, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ],
  "rolling": [
   { "pointer": "/friction/wave_generator/bearing_coefficient", "unit": "", "meaning": "Coefficient of friction μ_b of the bearing, from 0 to 1: friction torque over load times `bearing_radius_mm`.", "low": 0, "high": 1, "is_whole": false, "is_required": true },
   { "pointer": "/friction/wave_generator/bearing_element", "unit": "", "meaning": "Rolling element of the bearing. Default: ball.", "choices": [ "ball", "roller" ] },
   { "pointer": "/friction/wave_generator/bearing_load_rating_n", "unit": "N", "meaning": "Dynamic load rating C of the bearing, in N, for its life by ISO 281. Only for the bearing of an eccentric circle. Default: no life is calculated.", "low": 0.001, "high": 1000000000000, "is_whole": false, "is_required": false },
   { "pointer": "/friction/wave_generator/bearing_radius_mm", "unit": "mm", "meaning": "Radius R_b for the bearing's coefficient of friction, in mm.", "low": 1e-06, "high": 1000000, "is_whole": false, "is_required": true }
  ]
 }
};

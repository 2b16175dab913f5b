// What a depth camera reads: noise that grows with the distance, steps, and places where it reads nothing.
//
// structured_light: Nguyen, Izadi and Lovell, "Modeling Kinect Sensor Noise for Improved 3D Reconstruction
// and
//   Tracking" (3DIMPVT 2012), eq. 2: 1.2 mm + 1.9 mm/m^2 (z - 0.4 m)^2; projector 75 mm beside the camera
//   (Khoshelham and Elberink, "Accuracy and Resolution of Kinect Depth Data", Sensors 12 (2012)).
// stereo: z^2 s / (f b), Intel, "Tuning depth cameras for best performance": subpixel error s = 0.08 px and,
// for
//   the D435 at 848 x 480 and 90 degrees, f = 424 px, b = 50 mm: 3.8 mm/m^2 z^2, at 2 m 0.8 % (the data sheet
//   promises 2 %).
// time_of_flight: Azure Kinect DK hardware specifications: standard deviation at most 17 mm, taken as reached
//   at the far end of its narrow mode, 3.86 m: 4.4 mm/m z; systematic error below 11 mm + 0.1 % z, one for
//   each camera.
//
// Steps: stereo and structured light measure a disparity in whole steps, so that the steps of z grow with its
// square: step_mm at 1 m. Time of flight has the same step everywhere.
//
// Holes: stereo and structured light read nothing where the second eye, to the right by the baseline b,
// cannot see: left of near things, b f (1/z_near - 1/z_far) pixels wide. In time of flight the pixels at an
// edge mix two distances and are dropped, one on each side.
#pragma once

#include <opencv2/core/mat.hpp>

#include "sim/camera/noise.hpp"
#include "sim/scenario/camera.hpp"

namespace skylight::sim {

/// Standard deviation = floor + growth g(z): g = (z - 0.4 m)^2, z^2 or z by the model; metres.
struct DepthLaw {
  double floor_m = 0.0;
  double growth = 0.0;
  double baseline_m = 0.0;  ///< 0: none, one lens
};
/// The camera's own figures, or its model's where it has none.
DepthLaw depth_law(const DepthSpec& spec);
/// Standard deviation at a distance, metres, without the steps.
double depth_sigma(const DepthSpec& spec, double z_m);

/// depth (CV_16UC1, mm; 0: no reading) of what lies metres (CV_32FC1, z-depth; 0: nothing) before the camera.
/// Without noise: the exact depth, rounded to millimetres, within the range.
void measure_depth(const cv::Mat& metres, const CameraSpec& camera, const NoiseStream& stream,
                   cv::Mat& depth);

}  // namespace skylight::sim

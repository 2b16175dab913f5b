// The keys of a camera: where it hangs, lens, sensor, depth, the way of its frames.
#include "settings/fields.hpp"
#include "sim/scenario/fields.hpp"

namespace skylight::sim {

using settings::Fields;

void describe(Fields& fields, SensorSpec& sensor) {
  fields.about("Noise of the image sensor by its photon-transfer curve. Defaults: Sony IMX290 at 0 dB.");
  fields.field("noise", sensor.noise, {.help = "Off: the exact mean, rounded."});
  fields.field("full_well_e", sensor.full_well_e,
               {.min = 100, .max = 1e6, .unit = "electrons", .help = "Electrons at full scale with gain 1."});
  fields.field(
      "read_noise_e", sensor.read_noise_e,
      {.min = 0, .max = 1000, .unit = "electrons", .help = "Noise in the dark, standard deviation."});
  fields.field(
      "gain", sensor.gain,
      {.min = 1, .max = 64, .help = "Analogue gain: fewer electrons for the same picture, so more noise."});
}

void describe(Fields& fields, AutoExposureSpec& control) {
  fields.about("The camera's own control of its gain, which follows a change of light with some lag.");
  fields.field("enabled", control.enabled, {.help = "Off: the gain stays."});
  fields.field("target_grey", control.target_grey,
               {.min = 1, .max = 254, .help = "Mean grey level that it aims at."});
  fields.field("lag_s", control.lag_s,
               {.min = 0, .max = 60, .unit = "s", .help = "Time constant; 0: with the next frame."});
  fields.field("max_factor", control.max_factor,
               {.min = 1, .max = 64, .help = "Brightens at most so much, darkens at most to 1 / this."});
}

void describe(Fields& fields, DepthSpec& depth) {
  fields.about("Depth beside each image, millimetres along the optical axis.");
  fields.field("enabled", depth.enabled, {.help = "Whether the camera measures depth."});
  fields.field("noise", depth.noise, {.help = "Off: the exact depth, rounded, without holes."});
  fields.choice("model", depth.model,
                {{"structured_light", DepthModel::structured_light},
                 {"stereo", DepthModel::stereo},
                 {"time_of_flight", DepthModel::time_of_flight}},
                {.help = "How noise grows with the distance z: (z - 0.4 m)^2, z^2, z."});
  fields.field("noise_floor_m", depth.noise_floor_m,
               {.min = 0,
                .max = 1,
                .unit = "m",
                .help = "Standard deviation right before the camera; absent: the model's."});
  fields.field(
      "noise_growth", depth.noise_growth,
      {.min = 0,
       .max = 1,
       .help = "Its growth with the distance: 1/m, time_of_flight: without unit; absent: the model's."});
  fields.field("step_mm", depth.step_mm,
               {.min = 0.1,
                .max = 1000,
                .unit = "mm",
                .help = "Smallest difference of two readings at 1 m; it grows like the noise."});
  fields.field("holes", depth.holes,
               {.min = 0,
                .max = 20,
                .help = "Factor on the width of the stripes beside edges where nothing is read; 0: none."});
  fields.field("max_range_m", depth.max_range_m,
               {.min = 0.1, .max = 65, .unit = "m", .help = "No reading (0) beyond."});
}

void describe(Fields& fields, DeliverySpec& delivery) {
  fields.about("What the way from the sensor to the program does to frames.");
  fields.field("latency_s", delivery.latency_s,
               {.min = 0, .max = 10, .unit = "s", .help = "From the end of the exposure to the program."});
  fields.field("jitter_s", delivery.jitter_s,
               {.min = 0, .max = 10, .unit = "s", .help = "Further delay, 0 to this, evenly spread."});
  fields.field("drop_share", delivery.drop_share,
               {.min = 0, .max = 1, .help = "Share of the frames that are lost."});
  fields.field("clock_offset_s", delivery.clock_offset_s,
               {.min = -3600, .max = 3600, .unit = "s", .help = "Time stamp less true time."});
  fields.field("clock_drift_ppm", delivery.clock_drift_ppm,
               {.min = -1000, .max = 1000, .help = "The stamps run fast by so many millionths."});
  fields.field("jpeg_quality", delivery.jpeg_quality,
               {.min = 1, .max = 100, .help = "Compressed as JPEG on the way; absent: not."});
}

void describe(Fields& fields, CameraSpec& camera) {
  fields.about("A fixed camera. Pixels: the centre of the top-left one is (0, 0).");
  fields.field("id", camera.id, id_rules("Name, unlike any other camera's.", false));
  fields.field("position_m", camera.position_m,
               {.min = -200,
                .max = 200,
                .unit = "m",
                .help = "Optical centre in map: x, y, and the height above the floor."});
  fields.field("rpy_deg", camera.rpy_deg,
               {.min = -360,
                .max = 360,
                .unit = "deg",
                .help = "Roll, pitch, yaw about map x, y, z, in this order, away from straight down with the "
                        "image's right side towards map x."});
  fields.field("width_px", camera.width_px,
               {.min = 16, .max = 8192, .unit = "px", .help = "Width of the picture."});
  fields.field("height_px", camera.height_px,
               {.min = 16, .max = 8192, .unit = "px", .help = "Height of the picture."});
  fields.choice("lens", camera.lens,
                {{"brown_conrady", Lens::brown_conrady}, {"kannala_brandt", Lens::kannala_brandt}},
                {.help = "brown_conrady: pinhole with distortion; kannala_brandt: fisheye."});
  fields.field("fx_px", camera.fx_px, {.min = 10, .max = 1e5, .unit = "px", .help = "Focal length along x."});
  fields.field("fy_px", camera.fy_px, {.min = 10, .max = 1e5, .unit = "px", .help = "Focal length along y."});
  fields.field(
      "cx_px", camera.cx_px,
      {.min = 0, .max = 8191, .unit = "px", .help = "Principal point; absent: the picture's middle."});
  fields.field(
      "cy_px", camera.cy_px,
      {.min = 0, .max = 8191, .unit = "px", .help = "Principal point; absent: the picture's middle."});
  fields.field(
      "distortion", camera.distortion,
      {.min = -10, .max = 10, .help = "brown_conrady: k1 k2 p1 p2 k3; kannala_brandt: k1 k2 k3 k4 and 0."});
  fields.field("frame_rate_hz", camera.frame_rate_hz,
               {.min = 0.01, .max = 1000, .unit = "Hz", .help = "Frames a second."});
  fields.field("exposure_s", camera.exposure_s,
               {.above = 0, .max = 10, .unit = "s", .help = "Exposure of each frame."});
  fields.choice("shutter", camera.shutter, {{"global", Shutter::global}, {"rolling", Shutter::rolling}},
                {.help = "global: all rows at once; rolling: row after row from the top."});
  fields.field("readout_s", camera.readout_s,
               {.min = 0, .max = 1, .unit = "s", .help = "Rolling shutter: from the first row to the last."});
  fields.field("first_frame_s", camera.first_frame_s,
               {.min = 0,
                .max = 3600,
                .unit = "s",
                .help = "Start of the first exposure after the scenario's start."});
  fields.field("vignetting", camera.vignetting,
               {.min = 0, .max = 1, .help = "Share of the light missing in the picture's corners."});
  fields.field("sensor", camera.sensor);
  fields.field("auto_exposure", camera.auto_exposure);
  fields.field("depth", camera.depth);
  fields.field("delivery", camera.delivery);
}

}  // namespace skylight::sim

// What the paper itself says: K. Kononov, R. Lavrenov, L. Gavrilova, T. Tsoy, "External RGB-D Camera Based
// Mobile Robot Localization in Gazebo Environment with Real-Time Filtering and Smoothing Techniques". Metres;
// shares 0 to 1.
#pragma once

#include <array>
#include <string_view>

namespace skylight::service::reproduce::paper {

/// Table 1.
struct AcceptanceFigure {
  std::string_view configuration;
  std::string_view variant;  ///< of ours that it is set beside
  double alpha_m;
  double accepted;
  double mean_m;
};
inline constexpr std::array<AcceptanceFigure, 3> kTable1{{
    {"alpha = 0.25 m, before improvements", "vertical", 0.25, 0.82, 0.14},
    {"alpha = 0.25 m, after improvements", "ray", 0.25, 0.97, 0.09},
    {"alpha = 0.14 m, after improvements", "ray", 0.14, 0.82, 0.075},
}};

/// Fig. 6: windows of 5 to 24 with alpha 0.25 m; 12 was found best.
inline constexpr int kFirstWindow = 5;
inline constexpr int kLastWindow = 24;
inline constexpr double kAlphaOfWindows = 0.25;
inline constexpr int kBestWindow = 12;

/// Fig. 7: alpha of 0.05 to 0.5 m in steps of 0.025 with that window; "all values that are more than 0.2 m
/// give almost the same results"; 0.3 was taken.
inline constexpr double kFirstAlpha = 0.05;
inline constexpr double kAlphaStep = 0.025;
inline constexpr int kAlphas = 19;
inline constexpr double kPlateauFrom = 0.2;
inline constexpr double kBestAlpha = 0.3;

/// Table 2: mathematical expectation, dispersion, minimum.
struct ErrorRow {
  double mean_m;
  double dispersion_m;
  double minimum_m;
};
struct Table2Row {
  std::string_view movement;
  ErrorRow previously;
  ErrorRow currently;
};
inline constexpr std::array<Table2Row, 3> kTable2{{
    {"linear", {0.136, 0.045, 0.028}, {0.044, 0.015, 0.010}},
    {"curvilinear", {0.125, 0.055, 0.006}, {0.072, 0.029, 0.030}},
    {"average", {0.130, 0.049, 0.017}, {0.058, 0.022, 0.020}},
}};
/// "approximately 2.25 times": 0.130 / 0.058.
inline constexpr double kImprovement = 2.25;

}  // namespace skylight::service::reproduce::paper

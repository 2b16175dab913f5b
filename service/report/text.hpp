// Texts and numbers on their way into XML, CSV and JSON; independent of the locale.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace skylight::service::report {

/// Valid UTF-8 that XML 1.0 allows (section 2.2): everything else becomes U+FFFD.
std::string clean(std::string_view text);
/// clean(), with & < > " ' escaped: for XML text and attributes alike.
std::string escape(std::string_view text);

/// The shortest text that reads back as the same double; "" for NaN, "inf" and "-inf".
std::string exact(double value);
/// `digits` (0 to 12) behind the point, with a true minus sign and never "-0.000"; of a finite value.
std::string plain(double value, int digits);
/// As plain, but a dash for NaN, the sign of infinity, and powers of ten from 1e9 on.
std::string rounded(double value, int digits);
/// Four significant digits at most: for descriptions.
std::string short_text(double value);
/// mantissa × 10^exponent, the exponent raised.
std::string scientific(double mantissa, int mantissa_digits, int exponent);
/// To a tenth, as short as it goes: coordinates in pixels.
std::string px(double value);

/// Width of one line in pixels, never less than in DejaVu Sans, the widest of the usual screen fonts.
double text_width_px(std::string_view text, double font_px);
/// Lines that are at most `width_px` wide where the words allow it; at least one.
std::vector<std::string> wrap(const std::string& text, double width_px, double font_px);

}  // namespace skylight::service::report

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/plant/pictures/picture.h"

namespace imrig::plant::pictures {
namespace {

constexpr double kWidth = 560.0, kHeight = 310.0, kLeft = 70.0, kRight = 14.0, kTop = 46.0, kBottom = 46.0;
constexpr std::array<const char*, 4> kColours = {"#1b6ca8", "#c8553d", "#3a7d44", "#7a4fa3"};

// Round ticks; the ends are round too, or those of the data.
struct Axis {
  double low, high, step;
  Axis(double least, double most) {
    if (!(most - least > 1e-12 * std::max(std::abs(most), std::abs(least)))) least -= 1.0, most += 1.0;
    const double rough = (most - least) / 5.0, decade = std::pow(10.0, std::floor(std::log10(rough)));
    step = decade * (rough / decade > 5.0   ? 10.0
                     : rough / decade > 2.0 ? 5.0
                     : rough / decade > 1.0 ? 2.0
                                            : 1.0);
    // A curve that only grazes the next tick does not ask for it.
    low = step * std::floor(least / step + 0.02), high = step * std::ceil(most / step - 0.02);
  }
  void cut(double least, double most) { low = std::max(low, least), high = std::min(high, most); }
  std::vector<double> ticks() const {
    std::vector<double> at;
    for (double t = step * std::ceil(low / step - 1e-6); t <= high + 1e-6 * step; t += step)
      at.push_back(std::abs(t) < 0.5 * step ? 0.0 : t);
    return at;
  }
};

Axis axis_of(const Picture& p, std::vector<double> Series::*values, bool round) {
  double least = INFINITY, most = -INFINITY;
  for (const auto& s : p.series) {
    for (const double v : s.*values) least = std::min(least, v), most = std::max(most, v);
  }
  Axis axis(least, most);
  if (!round) axis.cut(least, most);
  return axis;
}

std::string text(double x, double y, const char* anchor, const std::string& what,
                 const std::string& more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     what);
}

std::string line(double x1, double y1, double x2, double y2, const char* colour) {
  return fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\"/>\n", x1, y1, x2, y2, colour);
}

// "-0.0" and "0.0" are one place.
std::string number(double v) { return fmt::format("{:.1f}", std::abs(v) < 0.05 ? 0.0 : v); }

}  // namespace

std::string svg(const Picture& p) {
  const Axis X = axis_of(p, &Series::x, p.square), Y = axis_of(p, &Series::y, true);
  double wide = kWidth - kLeft - kRight, high = kHeight - kTop - kBottom;
  if (p.square) {
    const double scale = std::min(wide / (X.high - X.low), high / (Y.high - Y.low));
    wide = scale * (X.high - X.low), high = scale * (Y.high - Y.low);
  }
  const double width = std::max(kLeft + wide + kRight, p.square ? 340.0 : 0.0),
               height = kTop + high + kBottom;
  const auto x = [&](double v) { return kLeft + wide * (v - X.low) / (X.high - X.low); };
  const auto y = [&](double v) { return kTop + high * (Y.high - v) / (Y.high - Y.low); };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" width=\"{:.0f}\" "
      "height=\"{:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<title>{}</title>\n"
      "<rect width=\"{:.0f}\" height=\"{:.0f}\" fill=\"#fff\"/>\n",
      width, height, width, height, p.title, width, height);
  out += text(kLeft, 16.0, "start", p.title, " font-weight=\"bold\"");
  for (const double t : X.ticks()) {
    out += line(x(t), kTop, x(t), kTop + high, "#e4e4e4");
    out += text(x(t), kTop + high + 16.0, "middle", fmt::format("{:.6g}", t));
  }
  for (const double t : Y.ticks()) {
    out += line(kLeft, y(t), kLeft + wide, y(t), "#e4e4e4");
    out += text(kLeft - 6.0, y(t) + 4.0, "end", fmt::format("{:.6g}", t));
  }
  out += text(kLeft + 0.5 * wide, kTop + high + 36.0, "middle", p.x_label);
  out += text(0.0, 0.0, "middle", p.y_label,
              fmt::format(" transform=\"translate(16 {:.1f}) rotate(-90)\"", kTop + 0.5 * high));
  std::size_t k = 0;
  double legend = kLeft;
  for (const auto& s : p.series) {
    const char* colour = kColours[k % kColours.size()];
    out += fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{} points=\"", colour,
                       s.dashed ? " stroke-dasharray=\"6 4\"" : "");
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (i > 0) out += " ";
      out += number(x(s.x[i])) + "," + number(y(s.y[i]));
    }
    out += "\"/>\n";
    if (!s.label.empty()) {
      out += fmt::format("<path d=\"M{:.1f} 32.0h20\" stroke=\"{}\" stroke-width=\"2\"{}/>\n", legend, colour,
                         s.dashed ? " stroke-dasharray=\"6 4\"" : "");
      out += text(legend + 26.0, 36.0, "start", s.label);
      legend += 46.0 + 6.6 * static_cast<double>(s.label.size());
    }
    ++k;
  }
  return out + "</svg>\n";
}

std::vector<Picture> all_pictures() {
  std::vector<Picture> all;
  for (const auto make :
       {magnetic_pictures, mechanical_pictures, fault_pictures, inverter_pictures, sensor_pictures}) {
    for (auto& picture : make()) all.push_back(std::move(picture));
  }
  return all;
}

}  // namespace imrig::plant::pictures

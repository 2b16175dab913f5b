#include "service/report/style.hpp"

#include <array>

namespace skylight::service::report {

Ink ink_of(Colour colour) {
  switch (colour) {
    case Colour::grey:
      return {"grey", "#6b7580"};
    case Colour::blue:
      return {"blue", "#0072b2"};
    case Colour::vermillion:
      return {"vermillion", "#d55e00"};
    case Colour::green:
      return {"green", "#009e73"};
    case Colour::purple:
      return {"purple", "#cc79a7"};
    case Colour::orange:
      return {"orange", "#e69f00"};
    case Colour::sky:
      return {"sky", "#56b4e9"};
    case Colour::automatic:
    case Colour::ink:
      break;
  }
  return {"ink", "#1a1d21"};
}

Colour automatic_colour(int n) {
  constexpr std::array<Colour, 6> kOrder{Colour::blue,   Colour::vermillion, Colour::green,
                                         Colour::purple, Colour::orange,     Colour::sky};
  return kOrder.at(static_cast<std::size_t>(n) % kOrder.size());
}

// On dark grounds the palette's blue is too dark: blue takes the place of sky, and sky that of yellow.
const std::string_view kPlotStyle = R"(
svg.plot{--ink:#1a1d21;--grey:#6b7580;--blue:#0072b2;--vermillion:#d55e00;--green:#009e73;--purple:#cc79a7;
--orange:#e69f00;--sky:#56b4e9;--grid:#e6e9ec;--minor:#f2f4f6;--ground:#fff}
@media screen and (prefers-color-scheme:dark){svg.plot{--ink:#e4e7ea;--grey:#99a3ad;--blue:#56b4e9;
--vermillion:#f0703a;--green:#1fb98c;--purple:#dd93bb;--orange:#e69f00;--sky:#f0e442;--grid:#2c3238;
--minor:#21262b;--ground:#15181b}}
svg.plot text{font-family:system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;fill:var(--ink)}
svg.plot .ink{color:var(--ink)} svg.plot .grey{color:var(--grey)} svg.plot .blue{color:var(--blue)}
svg.plot .vermillion{color:var(--vermillion)} svg.plot .green{color:var(--green)}
svg.plot .purple{color:var(--purple)} svg.plot .orange{color:var(--orange)} svg.plot .sky{color:var(--sky)}
svg.plot .grid{stroke:var(--grid)} svg.plot .minor{stroke:var(--minor)} svg.plot .ground{fill:var(--ground)}
svg.plot .tick,svg.plot .note{fill:var(--grey)} svg.plot .halo{stroke:var(--ground)}
)";

const std::string_view kPageStyle = R"(
:root{color-scheme:light dark;--text:#1a1d21;--muted:#5b6570;--line:#d5dade;--faint:#f5f7f8;--page:#fff;
--accent:#0067a3;--good:#00704f;--bad:#b04a00;--shade:#0003;--good-ground:#e5f5ef;--bad-ground:#fcece2}
@media screen and (prefers-color-scheme:dark){:root{--text:#e4e7ea;--muted:#9ba5af;--line:#353c43;--faint:#1d2125;
--page:#15181b;--accent:#6cbdf0;--good:#3fcf9f;--bad:#ff9b66;--shade:#000b;--good-ground:#143228;--bad-ground:#3d2415}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%;text-size-adjust:100%}
body{margin:0 auto;padding:2.5rem 1.25rem 4rem;max-width:53.75rem;background:var(--page);color:var(--text);
font:1rem/1.6 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;overflow-wrap:break-word}
a{color:var(--accent);text-decoration-thickness:1px;text-underline-offset:.15em}
a:focus-visible,.scroll:focus-visible{outline:2px solid var(--accent);outline-offset:2px}
h1{font-size:1.9rem;line-height:1.2;margin:0 0 .4rem;letter-spacing:-.01em}
h2{font-size:1.35rem;line-height:1.3;margin:3rem 0 .8rem;padding-top:.9rem;border-top:1px solid var(--line)}
h3{font-size:1.1rem;margin:2.2rem 0 .6rem} h4{font-size:1rem;margin:1.6rem 0 .5rem}
h2 .number,h3 .number,h4 .number{color:var(--muted);font-weight:400;margin-right:.6em}
p,ul,ol{margin:0 0 1rem;max-width:44rem} li{margin:.2rem 0}
.subtitle{font-size:1.1rem;color:var(--muted);margin-bottom:1.5rem}
.aside{border-left:3px solid var(--line);padding:.5rem .9rem}
.aside.good{border-color:var(--good);background:var(--good-ground)}
.aside.bad{border-color:var(--bad);background:var(--bad-ground)}
.aside.paper{color:var(--muted);font-style:italic}
code,pre{font-family:ui-monospace,"SF Mono",Menlo,Consolas,"DejaVu Sans Mono",monospace;font-size:.86em}
code{background:var(--faint);padding:.1em .3em;border-radius:3px;overflow-wrap:anywhere}
pre{background:var(--faint);border:1px solid var(--line);border-radius:4px;padding:.8rem 1rem;overflow-x:auto;
line-height:1.45}
dl.facts{display:grid;grid-template-columns:max-content 1fr;gap:.25rem 1.25rem;margin:0 0 1.5rem;font-size:.9rem}
dl.facts dt{color:var(--muted)} dl.facts dd{margin:0;overflow-wrap:anywhere;font-variant-numeric:tabular-nums}
nav{background:var(--faint);border:1px solid var(--line);border-radius:4px;padding:.9rem 1.1rem;font-size:.94rem}
nav h2{font-size:1rem;margin:0 0 .4rem;padding:0;border:0}
nav ul{list-style:none;margin:0;padding:0} nav li{margin:.15rem 0;padding-left:2.6em;text-indent:-2.6em}
nav li.level-2{margin-left:1.4em} nav li.level-3{margin-left:2.8em}
nav .number{display:inline-block;min-width:2.6em;text-indent:0;color:var(--muted);font-variant-numeric:tabular-nums}
nav a{text-decoration:none} nav a:hover{text-decoration:underline}
.scroll{overflow-x:auto;margin:1.6rem 0;background:linear-gradient(to left,var(--page) 40%,transparent) 100% 0/3rem
100% no-repeat local,linear-gradient(to left,var(--shade),transparent) 100% 0/.9rem 100% no-repeat scroll}
table{border-collapse:collapse;font-size:.88rem;line-height:1.4;font-variant-numeric:tabular-nums lining-nums;
border-bottom:1.5px solid var(--text)}
caption,figcaption{text-align:left;font-size:.9rem;line-height:1.5;color:var(--muted)}
caption{padding:0 0 .6rem} caption .words{display:inline-block;position:sticky;left:0;
max-width:min(44rem,calc(100vw - 2rem))} caption b,figcaption b{color:var(--text)}
thead tr:first-child>*{border-top:1.5px solid var(--text)}
thead tr:last-child>*{border-bottom:1px solid var(--text)}
th,td{padding:.32rem .6rem;vertical-align:baseline;white-space:nowrap} thead th{vertical-align:bottom;font-weight:600;white-space:normal}
tbody th{font-weight:400} tbody tr+tr>*{border-top:1px solid var(--line)}
tbody tr.rule>*{border-top:1px solid var(--text)} tbody tr.rule th{font-weight:600}
thead th.group{text-align:center;border-bottom:1px solid var(--line)}
.unit{color:var(--muted);font-weight:400} th.wrap,td.wrap{white-space:normal;min-width:11em;max-width:26em}
.left{text-align:left} .right{text-align:right} .centre{text-align:center}
td.good,th.good{color:var(--good);font-weight:600} td.bad,th.bad{color:var(--bad);font-weight:600}
td.paper,th.paper{color:var(--muted);font-style:italic}
.mark{display:inline-block;margin-right:.35em;font-weight:700;font-style:normal}
figure{margin:1.8rem 0} figure svg{display:block;width:100%;height:auto}
figcaption{max-width:44rem;margin-top:.3rem}
.gallery{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,15.5rem),1fr));gap:1.2rem 1.4rem;margin:1.8rem 0}
.gallery figure{margin:0} .narrow{display:none}
@media screen and (max-width:600px){body{padding:1.4rem 1rem 3rem} h1{font-size:1.5rem} .wide{display:none}
.narrow{display:block} dl.facts{display:block} dl.facts dt{margin-top:.5rem}
tbody th:first-child{position:sticky;left:0;background:var(--page)} th,td{padding:.32rem .5rem}}
@page{margin:16mm 14mm}
@media print{body{padding:0;max-width:none;font-size:10pt} a{color:inherit;text-decoration:none} h2,h3,h4{break-after:avoid}
figure,.scroll,tr,pre,.aside{break-inside:avoid} .scroll{overflow:visible;background:none} th,td{white-space:normal;padding:.25rem .45rem}
.gallery{grid-template-columns:repeat(3,1fr)}}
)";

}  // namespace skylight::service::report

#include "service/reproduce/experiments.hpp"

#include <algorithm>
#include <set>

namespace skylight::service::reproduce {
namespace {

std::vector<Ablation> all_ablations() {
  return {{"as it is", {}},
          {"exposure of 0.1 ms: no motion blur", {"cameras[0].exposure_s=0.0001"}},
          {"no sensor noise", {"cameras[0].sensor.noise=false"}},
          {"even light: no lamps, shadows, gradient, flicker, vignetting",
           {"light.lamps=[]", "light.gradient=0", "light.contact_shadow=0", "light.flicker.depth=0",
            "cameras[0].vignetting=0"}},
          {"floor of one colour", {"room.floor.material=plain"}},
          {"a lens without distortion", {"cameras[0].distortion=[0,0,0,0,0]"}}};
}

}  // namespace

Plan full_plan(int seeds) {
  Plan plan;
  plan.paper.seeds = seeds;
  plan.routes.seeds = seeds;
  plan.routes.routes = paper_routes();
  plan.occlusion = {.folder = "occlusion", .routes = {"line", "arc"}, .seeds = 30};
  plan.ablated = {.routes = {"line-2", "circle-2", "chaotic-1"}, .seeds = 1};
  plan.ablations = all_ablations();
  return plan;
}

Plan quick_plan() {
  Plan plan = full_plan();
  plan.quick = true;
  plan.paper = quick_paper_plan();
  plan.resolution = quick_resolution_plan();
  plan.routes.routes = {"line-2", "line-7", "circle-2", "chaotic-1"};
  plan.routes.seeds = 1;
  plan.routes.at_most_s = 12.0;
  plan.occlusion.seeds = 1;
  plan.ablated.routes = {"circle-2"};
  plan.ablated.at_most_s = 5.0;
  plan.ablations.resize(2);
  return plan;
}

Gathered gather(const Plan& plan, const GatherOptions& options) {
  Gathered out{.plan = plan,
               .paper = {},
               .resolution = {},
               .routes = {},
               .occlusion = {},
               .ablations = {},
               .mrclam = {}};
  const auto kept = [&](const std::string& stage) {
    return JobOptions{.folder = options.folder,
                      .threads = options.threads,
                      .progress = [&options, stage](const Progress& progress) {
                        if (options.progress) options.progress(stage, progress);
                      }};
  };
  if (plan.mrclam) {
    out.mrclam = run_mrclam(*plan.mrclam,
                            {.noise = {}, .seconds = plan.quick ? 120.0 : 0.0, .threads = options.threads});
  }
  out.resolution = resolution_curve(plan.resolution, kept("share found over resolution"));
  out.paper = run_jobs(paper_jobs(plan.paper), kept("the paper's pipeline"));
  out.routes = run_jobs(skylight_jobs(plan.routes), kept("Skylight along the routes"));
  out.occlusion = run_jobs(skylight_jobs(plan.occlusion), kept("under a beam"));
  for (const Ablation& ablation : plan.ablations) {
    SkylightPlan changed = plan.ablated;
    changed.changes = ablation.changes;
    out.ablations.push_back(run_jobs(skylight_jobs(changed), kept(ablation.name)));
  }
  return out;
}

std::vector<const ObservedRun*> chosen(const Runs& runs,
                                       const std::function<bool(const ObservedRun&)>& keep) {
  std::vector<const ObservedRun*> out;
  for (const ObservedRun& run : runs) {
    if (keep(run)) out.push_back(&run);
  }
  return out;
}

std::vector<const ObservedRun*> linear_runs(const Runs& runs) {
  return chosen(runs, [](const ObservedRun& run) { return is_linear(run.route); });
}

std::vector<const ObservedRun*> curved_runs(const Runs& runs) {
  return chosen(runs, [](const ObservedRun& run) { return !is_linear(run.route); });
}

report::Document document(const Gathered& gathered, std::vector<report::Fact> facts) {
  report::Document out{.title = "The paper reproduced, and what the same camera can do",
                       .subtitle =
                           "External RGB-D camera based mobile robot localization: the paper's "
                           "experiments in Skylight's simulator, and Skylight's own figures beside them",
                       .facts = std::move(facts),
                       .sections = {}};
  std::set<std::uint64_t> seeds;
  for (const ObservedRun& run : gathered.routes) seeds.insert(run.seed);
  std::string text;
  for (const std::uint64_t seed : seeds) text.append(text.empty() ? "" : ", ").append(std::to_string(seed));
  out.facts.push_back({"Seeds of each route", text});
  out.facts.push_back(
      {"Extent", gathered.plan.quick ? "quick: a few routes, one seed, cut short" : "complete"});
  for (auto& section : skylight_sections(gathered)) out.sections.push_back(std::move(section));
  for (auto& section : paper_sections(gathered)) out.sections.push_back(std::move(section));
  if (gathered.mrclam) out.sections.push_back(mrclam_section(*gathered.mrclam));
  return out;
}

}  // namespace skylight::service::reproduce

"""How the page looks: on a screen by day and by night, and on paper of size A4."""

from __future__ import annotations

STYLE = """
:root { color-scheme: light dark; --paper: #fdfcf9; --ink: #2b2925; --soft: #6a655c;
  --line: #ddd7cb; --tint: #f3efe6; --good: #2f6b4f; --bad: #a8321f; --mark: #2f6f73;
  --gap: #e3b04b; }
@media (prefers-color-scheme: dark) { :root { --paper: #1d1c1a; --ink: #e9e5dc; --soft: #a8a297;
  --line: #45413a; --tint: #282622; --good: #7fc3a0; --bad: #ef8a76; --mark: #7fc0c4;
  --gap: #b98a2e; } }
* { box-sizing: border-box; }
html { font: 16px/1.5 system-ui, "Segoe UI", "Helvetica Neue", Arial, "Noto Sans", sans-serif;
  background: var(--paper); color: var(--ink); -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; max-width: 64rem; padding: 2.5rem 1.5rem 4rem; overflow-wrap: break-word; }
h1, h2, h3 { font-family: "Iowan Old Style", "Palatino Linotype", Palatino, Georgia, serif;
  line-height: 1.2; font-weight: 600; margin: 0; }
h1 { font-size: 2.3rem; letter-spacing: -.01em; }
h2 { font-size: 1.55rem; margin-top: 3.2rem; padding-top: .9rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1.12rem; margin: 1.8rem 0 .5rem; }
p { margin: .5rem 0; max-width: 46rem; }
a { color: var(--mark); }
header p { color: var(--soft); margin: .4rem 0 0; }
nav { margin: 1.4rem 0 0; font-size: .92rem; }
nav ul { list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap;
  gap: .2rem 1.3rem; }
.lead { font-size: 1.12rem; margin-top: 1.6rem; }
.note { color: var(--soft); font-size: .88rem; }
.plans { display: grid; grid-template-columns: repeat(auto-fit, minmax(17rem, 1fr)); gap: 1.6rem;
  margin: 1.4rem 0; }
.plans.one { grid-template-columns: 1fr; }
.plans article > img { width: 100%; height: auto; display: block; border: 1px solid var(--line);
  background: #fff; }
.plans h3 { margin: .6rem 0 .2rem; }
dl.key { display: flex; flex-wrap: wrap; gap: .6rem 2.2rem; margin: .6rem 0 0; }
dl.key div { min-width: 7rem; max-width: 13rem; }
dl.key dt { color: var(--soft); font-size: .8rem; line-height: 1.3; }
dl.key dd { margin: 0; font-size: 1.3rem; font-variant-numeric: tabular-nums; }
figure { margin: 1.4rem 0 1.8rem; }
.map { position: relative; border: 1px solid var(--line); background: #fff; line-height: 0; }
.map img { width: 100%; height: auto; display: block; }
.map svg { position: absolute; inset: 0; width: 100%; height: 100%; }
figcaption { color: var(--soft); font-size: .88rem; margin-top: .45rem; }
.legend { list-style: none; margin: .6rem 0 0; padding: 0; columns: 15rem; font-size: .85rem; }
.legend li { display: flex; align-items: center; gap: .5rem; break-inside: avoid; }
.legend li.heading { font-weight: 600; margin-top: .35rem; break-after: avoid; }
.legend img { flex: none; border-radius: 2px; background: #fff; }
.wide { overflow-x: auto; margin: .6rem 0 1.4rem; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
caption { text-align: left; color: var(--soft); font-size: .88rem; padding-bottom: .3rem; }
th, td { text-align: left; vertical-align: top; padding: .32rem 1rem .32rem 0;
  border-bottom: 1px solid var(--line); font-weight: 400; }
th:last-child, td:last-child { padding-right: 0; }
thead th { color: var(--soft); font-size: .84rem; border-bottom: 1px solid var(--ink); }
th.group { font-weight: 600; padding-top: 1rem; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.best { font-weight: 700; color: var(--mark); }
.met { color: var(--good); } .missed { color: var(--bad); } .unknown { color: var(--soft); }
.bar { width: 100%; max-width: 34rem; height: auto; display: block; margin: .5rem 0; }
details { margin: .4rem 0 1.2rem; } summary { cursor: pointer; color: var(--mark); }
.vh { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%);
  white-space: nowrap; }
footer { margin-top: 3.5rem; padding-top: .9rem; border-top: 1px solid var(--line);
  color: var(--soft); font-size: .85rem; }
@page { size: A4; margin: 17mm 16mm 18mm; }
@media print {
  :root { color-scheme: light; --paper: #fff; --ink: #1f1d1a; --soft: #5c574f; --line: #d5cfc3;
    --tint: #f3efe6; --good: #2f6b4f; --bad: #a8321f; --mark: #2f6f73; --gap: #e3b04b; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  html { font-size: 10pt; } body { max-width: none; padding: 0; } nav { display: none; }
  section.design { break-before: page; }
  section.design > h2 { border-top: 0; margin-top: 0; padding-top: 0; }
  h2, h3, caption, figcaption { break-after: avoid; } h2 { margin-top: 2rem; }
  figure, .plans article, tr, dl.key { break-inside: avoid; }
  .map { width: fit-content; margin: 0 auto; }
  .map img { width: auto; max-width: 100%; max-height: 175mm; }
  .plans.one article > img { width: auto; max-width: 100%; max-height: 120mm; }
  thead { display: table-header-group; } .wide { overflow: visible; }
  a { color: inherit; text-decoration: none; }
}
"""

// A headless Chromium, and pages in it that are watched: what they log, and what they ask for.
import chromium from '@sparticuz/chromium';
import puppeteer from 'puppeteer-core';

export const launch = async () =>
  puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? (await chromium.executablePath()),
    headless: 'shell',
    args: [
      '--no-sandbox',
      '--use-angle=swiftshader',
      '--enable-unsafe-swiftshader',
      '--force-device-scale-factor=1',
    ],
    protocolTimeout: 120000,
  });

/** The page at an address once it is ready; its `faults` are what it logs, `asked` what it asks for. */
export async function watched(browser, address, { width = 800, height = 700, scheme = 'light' } = {}) {
  const page = await browser.newPage();
  await page.setViewport({ width, height });
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
  page.faults = [];
  page.asked = [];
  // Reading pixels stalls the software renderer, and the driver says so.
  page.on('console', m => {
    if (['error', 'warn'].includes(m.type()) && !/GPU stall/.test(m.text())) page.faults.push(m.text());
  });
  page.on('pageerror', fault => page.faults.push(String(fault)));
  page.on('request', request => {
    if (!/^(blob|data):/.test(request.url())) page.asked.push(request.url());
  });
  const network = await page.createCDPSession();
  await network.send('Network.enable');
  network.on('Network.webSocketCreated', ({ url }) => page.asked.push(url));
  await page.goto(address);
  await page
    .waitForFunction(() => window.pliant?.ready, { timeout: 60000, polling: 50 })
    .catch(fault => {
      throw new Error([address, fault.message, ...page.faults].join('; '));
    });
  return page;
}
